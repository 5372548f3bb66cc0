#include "client/arm_sight.hpp"

#include <algorithm>

namespace softarm {
namespace {

constexpr std::int64_t kSpeedSpan_ns =
    50'000'000;  ///< long enough that noise does not read as speed

double largest_norm(const SegmentVector& pairs) {
  double largest = 0.0;
  for (Eigen::Index k = 0; k + 1 < pairs.size(); k += 2)
    largest = std::max(largest, pairs.segment<2>(k).norm());
  return largest;
}

}  // namespace

ArmSight::ArmSight(const Experiment& experiment)
    : segments_(experiment.arm.size()),
      estimator_(experiment.estimation, experiment.arm,
                 body_noise(experiment.estimation, experiment.arm.size())) {}

void ArmSight::take(const MocapFrame& frame, std::int64_t arrival_ns) {
  if (frame.frame_number == last_number_ || frame.capture_ns <= seen_.capture_ns) return;
  last_number_ = frame.frame_number;
  estimator_.estimate(frame, estimate_);
  if (!std::all_of(estimate_.valid.begin(), estimate_.valid.begin() + segments_,
                   [](bool each) { return each; }))
    return;
  recent_.push_back({arrival_ns, estimate_.u_rad});
  while (recent_.size() > 10 && recent_[1].arrival_ns < arrival_ns - kSpeedSpan_ns)
    recent_.pop_front();
  seen_ = {.arrival_ns = arrival_ns,
           .capture_ns = frame.capture_ns,
           .u_rad = estimate_.u_rad,
           .bend_rad = largest_norm(estimate_.u_rad),
           .speed_radps = speed_radps()};
}

double ArmSight::speed_radps() const {
  const double span_s = to_seconds(recent_.back().arrival_ns - recent_.front().arrival_ns);
  // Frames delivered all at once after a stall are not motion.
  if (span_s <= to_seconds(kSpeedSpan_ns) / 2.0) return 0.0;
  return largest_norm(recent_.back().u_rad - recent_.front().u_rad) / span_s;
}

}  // namespace softarm
