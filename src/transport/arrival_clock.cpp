#include "softarm/transport/arrival_clock.hpp"

#include <algorithm>

namespace softarm {

ArrivalClock::ArrivalClock(ClockPair now) noexcept
    : look_ns_(now.monotonic_ns), wall_minus_ns_(now.wall_ns - now.monotonic_ns) {
  look(now);
}

void ArrivalClock::look(ClockPair now) noexcept {
  look_before_ns_ = look_ns_;
  wall_minus_before_ns_ = wall_minus_ns_;
  look_ns_ = now.monotonic_ns;
  wall_minus_ns_ = now.wall_ns - now.monotonic_ns;
}

std::int64_t ArrivalClock::arrival_ns(std::int64_t stamp_us) noexcept {
  const std::int64_t earliest_ns = std::max(newest_ns_, look_before_ns_ - kLongestWait_ns);
  std::int64_t arrival_ns = kNever;
  if (is_time_us(stamp_us))
    for (const std::int64_t wall_minus_ns : {wall_minus_ns_, wall_minus_before_ns_}) {
      const std::int64_t candidate_ns = 1000 * stamp_us - wall_minus_ns;
      if (candidate_ns >= earliest_ns && candidate_ns <= look_ns_)
        arrival_ns = std::max(arrival_ns, candidate_ns);
    }
  newest_ns_ = arrival_ns == kNever ? look_ns_ : arrival_ns;
  return newest_ns_;
}

}  // namespace softarm
