// A record to parameters: linear least squares for a start, then the simulated response.
#pragma once

#include <vector>

#include "softarm/commissioning/identification/linear_fit.hpp"
#include "softarm/commissioning/identification/refinement.hpp"

namespace softarm {

/// How the search for the parameters begins and refines.
struct IdentifyOptions {
  double window_s = 0.2;       ///< of the smoothing for the start
  double longest_lag_s = 0.5;  ///< that the start considers
  RefinementOptions refinement;
  /// Arms from which the search may start as well, if one is nearer than what least squares find.
  std::vector<ArmHypothesis> near;
};

/// @throws std::runtime_error as `fit_linear` and `refine`
Refinement identify(const ParameterSet& set, const MotionRecord& record,
                    const IdentifyOptions& options);

}  // namespace softarm
