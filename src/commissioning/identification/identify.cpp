#include "softarm/commissioning/identification/identify.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace softarm {
namespace {

/// RMS of the residual of an arm over all records, infinite if it has no bounded response.
double distance(const ParameterSet& set, std::span<const MotionRecord> records,
                const Eigen::VectorXd& x) {
  double squares = 0.0, count = 0.0;
  try {
    for (const MotionRecord& record : records) {
      const Refinement it = predict(set, record, x);
      const auto frames = static_cast<double>(it.time_s.size());
      squares += frames * it.rms_rad * it.rms_rad;
      count += frames;
    }
  } catch (const std::runtime_error&) {
    return std::numeric_limits<double>::infinity();
  }
  return std::sqrt(squares / count);
}

}  // namespace

Refinement identify(const ParameterSet& set, const MotionRecord& record,
                    const IdentifyOptions& options) {
  return identify(set, std::span(&record, 1), options);
}

Refinement identify(const ParameterSet& set, std::span<const MotionRecord> records,
                    const IdentifyOptions& options) {
  const Eigen::VectorXd expected = set.expected();
  // With noise and smoothing, a motion with little information may give nonsense: take the nearest.
  Eigen::VectorXd nearest = expected;
  double least = distance(set, records, expected);
  const auto consider = [&](const Eigen::VectorXd& tried) {
    const Eigen::VectorXd x = tried.cwiseMax(set.lowest()).cwiseMin(set.highest());
    const double found = distance(set, records, x);
    if (found >= least) return;
    nearest = x;
    least = found;
  };
  if (!set.of_elongation())
    consider(
        fit_linear_and_lag(set, records.front(), expected, options.window_s, options.longest_lag_s)
            .x);
  for (const ArmHypothesis& arm : options.near) {
    // What the other arm leaves out starts where it is expected.
    Eigen::VectorXd x = set.of(arm);
    consider(x);
    for (Eigen::Index i = 0; i < x.size(); ++i)
      if (x[i] == 0.0) x[i] = expected[i];
    consider(x);
  }
  return refine(set, records, nearest, options.refinement);
}

}  // namespace softarm
