// The result of an identification, as text and as a configuration.
#pragma once

#include <filesystem>
#include <string>

#include "softarm/commissioning/identification/coverage.hpp"
#include "softarm/commissioning/identification/linear_fit.hpp"
#include "softarm/commissioning/identification/refinement.hpp"

namespace softarm {

/// One line per parameter with its 95 % interval, then the residual.
std::string fit_table(const ParameterSet& set, const Refinement& fit);
/// The same for linear least squares alone, with standard errors.
std::string linear_table(const ParameterSet& set, const LinearFit& fit);
/// Singular values, the least determined combination, and those that are not determined.
std::string conditioning_text(const ParameterSet& set, const Refinement& fit);
/// The result of a coverage study as a table.
std::string coverage_text(const CoverageTable& table);

/// An experiment file that includes `config` and replaces the configured arm by the identified one;
/// the plant is kept. `note` becomes a comment. The path of the include is relative to `output`.
std::string identified_yaml(const Experiment& experiment, const ArmHypothesis& arm,
                            const FitChoice& choice, const std::string& note,
                            const std::filesystem::path& config,
                            const std::filesystem::path& output);

/// Time, measured and simulated u of every frame, for tools/plot_identification.py.
std::string residuals_csv(const Refinement& fit);

}  // namespace softarm
