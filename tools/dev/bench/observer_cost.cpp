// What the model observer costs on arms of every length.
#include <algorithm>
#include <vector>

#include "dev/bench/robustness_scenes.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/estimation/model_observer.hpp"
#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kMs = 1'000'000;

double median_us(std::vector<std::int64_t>& durations_ns) {
  const auto middle = durations_ns.begin() + static_cast<std::ptrdiff_t>(durations_ns.size() / 2);
  std::nth_element(durations_ns.begin(), middle, durations_ns.end());
  return 1e-3 * static_cast<double>(*middle);
}

/// An arm of the paper's size and weight in n segments, bent alike.
ObserverCost cost_of(int n) {
  ArmParameters arm;
  arm.segments.assign(static_cast<std::size_t>(n), {0.33 / n, 0.45 / n, 1.9 / n, 0.09 / n});
  EstimationSettings settings;
  ModelObserver observer(arm, settings, body_noise(settings, n), {.valve_lag_s = 0.02});
  CurvatureEstimator estimator(settings, arm, body_noise(settings, n));
  KnownMotion reference;
  reference.u_rad = SegmentVector::Constant(2 * n, 0.9 / n);
  reference.velocity_radps = reference.acceleration_radps2 = SegmentVector::Zero(2 * n);
  std::vector<Eigen::Isometry3d> ends(static_cast<std::size_t>(n));
  forward_kinematics(arm, reference.u_rad, ends);
  MocapFrame frame;
  frame.segments = n;
  frame.body[0] = {arm.base_position_m, Eigen::Quaterniond(arm.base_rotation), true};
  for (std::size_t i = 0; i < ends.size(); ++i)
    frame.body[i + 1] = {ends[i].translation(), Eigen::Quaterniond(ends[i].linear()), true};
  CurvatureEstimate estimate;
  estimator.estimate(frame, estimate);
  const SegmentVector tau = SegmentVector::Zero(2 * n);
  FilteredMotion motion;
  std::vector<std::int64_t> frames_ns, ticks_ns;
  for (std::int64_t now_ns = kMs; now_ns < 2000 * kMs; now_ns += kMs) {
    const std::int64_t begin_ns = monotonic_now_ns();
    if (now_ns % (5 * kMs) == 0) {
      frame.capture_ns = now_ns - 5 * kMs;
      observer.update(frame, estimate, &reference, true);
      observer.predict(now_ns, now_ns + kMs, motion);
      frames_ns.push_back(monotonic_now_ns() - begin_ns);
    } else if (now_ns % (2 * kMs) == 0) {
      observer.predict(now_ns, now_ns + kMs, motion);
      ticks_ns.push_back(monotonic_now_ns() - begin_ns);
    }
    if (now_ns % (2 * kMs) == 0) observer.command(now_ns, tau);
  }
  return {n, median_us(ticks_ns), median_us(frames_ns)};
}

}  // namespace

std::vector<ObserverCost> observer_costs() {
  std::vector<ObserverCost> costs;
  for (const int n : {1, 2, 3, 4, 6, 7, 10, 20}) costs.push_back(cost_of(n));
  return costs;
}

}  // namespace softarm
