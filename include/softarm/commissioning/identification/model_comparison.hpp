// What each term beyond (16) buys on one record, and whether it holds on what was not fitted.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "softarm/commissioning/identification/identify.hpp"

namespace softarm {

/// One choice of unknowns on the whole record and between its halves. Every RMS is that of a
/// component of measured minus simulated u, in rad; simulated is the response to the recorded input
/// alone, from rest under its first value: no measured u enters it. NaN where the model has no
/// bounded response.
struct CrossValidation {
  Refinement whole;                  ///< identified and compared on the whole record
  double second_by_first_rad = 0.0;  ///< identified on the first half, compared on the second
  double first_by_second_rad = 0.0;
  bool converged = false;  ///< all three searches
  /// By the whole, the first and the second half.
  std::vector<ArmHypothesis> found;
};

/// The halves are those of the time that is scored; the simulation of the second begins 10 s before
/// it, or where the record does. The search in each part may start from the arm that `simpler`
/// found there.
/// @throws std::runtime_error as `identify`
CrossValidation cross_validate(const ParameterSet& set, const MotionRecord& record,
                               const IdentifyOptions& options,
                               const CrossValidation* simpler = nullptr);

/// One choice of terms, and how well it fits and predicts.
struct ModelTrial {
  std::string name;
  bool damping = true;  ///< sought
  Eigen::Index parameters = 0;
  CrossValidation result;
};

/// What each further term of the model gains on one record.
struct ModelComparison {
  std::vector<ModelTrial> trials;  ///< the last is the choice asked for
  double motion_rad = 0.0;         ///< of the motion about its mean
};

/// Gains with k and beta as configured, those with a lag; then the model (16), that with one term
/// more at a time, with all of them; then the terms of `choice`. What `choice` says of k, inertia,
/// directions and the sharing of gains holds for all; components weigh alike. Without inertia and
/// damping the arm follows within 20 ms.
ModelComparison compare_models(const Experiment& experiment, const MotionRecord& record,
                               const FitChoice& choice, const IdentifyOptions& options,
                               const std::function<void(const std::string&)>& progress);

std::string comparison_text(const ModelComparison& comparison);

}  // namespace softarm
