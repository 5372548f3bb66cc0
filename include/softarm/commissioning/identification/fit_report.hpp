// What was identified, for people and as a configuration.
#pragma once

#include <filesystem>
#include <string>

#include "softarm/commissioning/identification/coverage.hpp"
#include "softarm/commissioning/identification/linear_fit.hpp"
#include "softarm/commissioning/identification/refinement.hpp"

namespace softarm {

/// A line a parameter with its 95 % interval, then what is left over.
std::string fit_table(const ParameterSet& set, const Refinement& fit);
/// The same of least squares alone, with standard errors.
std::string linear_table(const ParameterSet& set, const LinearFit& fit);
/// Singular values, the combination told least, and those that are not told at all.
std::string conditioning_text(const ParameterSet& set, const Refinement& fit);
std::string coverage_text(const CoverageTable& table);

/// An experiment that includes `config` and has the arm found in place of the one configured; its
/// plant stays as it is. `note` becomes a comment. The path of the include is seen from `output`.
std::string identified_yaml(const Experiment& experiment, const ArmHypothesis& arm,
                            const FitChoice& choice, const std::string& note,
                            const std::filesystem::path& config,
                            const std::filesystem::path& output);

/// Time, measured and simulated u of every frame, for tools/plot_identification.py.
std::string residuals_csv(const Refinement& fit);

}  // namespace softarm
