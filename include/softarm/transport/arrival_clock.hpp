// When a message arrived, on our monotonic clock.
#pragma once

#include <algorithm>
#include <cstdint>

#include "softarm/base/clock.hpp"
#include "softarm/transport/lcm_node.hpp"

namespace softarm {

/// LCM's receive thread stamps arrivals with the wall clock, so that what else we do does not count
/// as jitter. Brought to our clock they can only lie between the last round of handling and this
/// one: a wall clock that is set meanwhile does no harm.
class ArrivalClock {
 public:
  /// A round of handling begins. @param now_ns of our clock, not decreasing
  void begin_round(std::int64_t now_ns) noexcept {
    previous_ns_ = now_ns_;
    now_ns_ = now_ns;
    wall_minus_ns_ = wall_now_ns() - now_ns;
  }
  std::int64_t now_ns() const noexcept { return now_ns_; }
  /// @param wall_us  ReceivedMessage::arrival_utime_us of a message that is handled in this round
  std::int64_t arrival_ns(std::int64_t wall_us) const noexcept {
    return std::clamp(wall_us * 1000 - wall_minus_ns_, previous_ns_, now_ns_);
  }

 private:
  std::int64_t previous_ns_ = 0, now_ns_ = 0, wall_minus_ns_ = 0;
};

}  // namespace softarm
