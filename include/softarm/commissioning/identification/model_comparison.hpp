// The gain in accuracy by each term beyond (16) on one record, with cross-validation.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "softarm/commissioning/identification/identify.hpp"

namespace softarm {

/// One choice of unknowns on the whole record and between its halves. Every RMS is that of a
/// component of measured minus simulated u, in rad. The simulated u is the response to the recorded
/// input alone, from rest under its first value: no measured u enters it. NaN if the model has no
/// bounded response.
struct CrossValidation {
  Refinement whole;                  ///< identified and compared on the whole record
  double second_by_first_rad = 0.0;  ///< identified on the first half, compared on the second
  double first_by_second_rad = 0.0;
  bool converged = false;  ///< all three searches converged
  /// The arms identified on the whole record, its first and its second half.
  std::vector<ArmHypothesis> found;
};

/// Cross-validates one choice of unknowns. The halves are those of the scored time; the simulation
/// of the second half begins 10 s before it, or at the beginning of the record. The search in each
/// part may start from the arm that `simpler` found there.
/// @throws std::runtime_error as `identify`
CrossValidation cross_validate(const ParameterSet& set, const MotionRecord& record,
                               const IdentifyOptions& options,
                               const CrossValidation* simpler = nullptr);

/// One row of the comparison.
struct ModelTrial {
  std::string name;
  bool damping = true;  ///< identified, not as configured
  Eigen::Index parameters = 0;
  CrossValidation result;
};

/// The result of compare_models.
struct ModelComparison {
  std::vector<ModelTrial> trials;  ///< the last is the requested choice
  double motion_rad = 0.0;         ///< RMS of the motion about its mean
};

/// Compares: gains with k and beta as configured, the same with a lag; the model (16), (16) with
/// each further term, and with all of them; finally the terms of `choice`. The settings of `choice`
/// for k, inertia, directions and sharing of gains apply to all; all components have the same
/// weight. Without inertia and damping the arm follows within 20 ms.
ModelComparison compare_models(const Experiment& experiment, const MotionRecord& record,
                               const FitChoice& choice, const IdentifyOptions& options,
                               const std::function<void(const std::string&)>& progress);

/// The comparison as a table for a person.
std::string comparison_text(const ModelComparison& comparison);

}  // namespace softarm
