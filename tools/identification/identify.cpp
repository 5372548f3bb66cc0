#include "identification/identify.hpp"

namespace softarm {

Refinement identify(const ParameterSet& set, const MotionRecord& record,
                    const IdentifyOptions& options) {
  const Eigen::VectorXd believed = set.believed();
  const LinearFit start =
      fit_linear_and_lag(set, record, believed, options.window_s, options.longest_lag_s);
  // Noise and smoothing may make nonsense of a motion that tells little.
  return refine(set, record, set.possible(start.x) ? start.x : believed, options.refinement);
}

}  // namespace softarm
