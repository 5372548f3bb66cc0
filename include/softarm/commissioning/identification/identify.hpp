// From a record to parameters: linear least squares for a start, then fit of the simulated
// response.
#pragma once

#include <span>
#include <vector>

#include "softarm/commissioning/identification/linear_fit.hpp"
#include "softarm/commissioning/identification/refinement.hpp"

namespace softarm {

/// Settings of `identify`.
struct IdentifyOptions {
  double window_s = 0.2;       ///< of the smoothing in the linear fit
  double longest_lag_s = 0.5;  ///< considered by the linear fit
  RefinementOptions refinement;
  /// Other arms from which the search may start, if one is nearer than the result of least squares.
  std::vector<ArmHypothesis> near;
};

/// Identifies the parameters of `set` from `record`.
/// @throws std::runtime_error as `fit_linear` and `refine`
Refinement identify(const ParameterSet& set, const MotionRecord& record,
                    const IdentifyOptions& options);
/// The same from several records of one arm with one zero; least squares starts from the first.
Refinement identify(const ParameterSet& set, std::span<const MotionRecord> records,
                    const IdentifyOptions& options);

}  // namespace softarm
