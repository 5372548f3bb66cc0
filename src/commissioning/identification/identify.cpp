#include "softarm/commissioning/identification/identify.hpp"

#include <limits>
#include <stdexcept>

namespace softarm {
namespace {

/// RMS of the residual of an arm, infinite if it has no bounded response.
double distance_rad(const ParameterSet& set, const MotionRecord& record, const Eigen::VectorXd& x) {
  try {
    return predict(set, record, x).rms_rad;
  } catch (const std::runtime_error&) {
    return std::numeric_limits<double>::infinity();
  }
}

}  // namespace

Refinement identify(const ParameterSet& set, const MotionRecord& record,
                    const IdentifyOptions& options) {
  const Eigen::VectorXd configured = set.configured();
  const LinearFit start =
      fit_linear_and_lag(set, record, configured, options.window_s, options.longest_lag_s);
  // With noise and smoothing, a motion with little information may give nonsense: take the nearest.
  Eigen::VectorXd nearest = configured;
  double least_rad = distance_rad(set, record, configured);
  const auto consider = [&](const Eigen::VectorXd& x) {
    const double distance = distance_rad(set, record, x);
    if (distance >= least_rad) return;
    nearest = x;
    least_rad = distance;
  };
  consider(start.x.cwiseMax(set.lowest()));
  for (const ArmHypothesis& arm : options.near) consider(set.of(arm).cwiseMax(set.lowest()));
  return refine(set, record, nearest, options.refinement);
}

}  // namespace softarm
