// Converts arrival times of packets, which LCM stamps with the wall clock, to our monotonic clock.
#pragma once

#include <cstdint>

#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"

namespace softarm {

/// Converts LCM's receive stamps (the wall clock of the kernel when the packet came in) to our
/// monotonic clock. The difference of the clocks is updated by every `look`. If the wall clock was
/// set between two looks, a stamp may belong to the clock before or after; of the possible arrivals
/// the later one counts. So setting the clock never makes a packet appear older than it is, and
/// younger by no more than the time from its arrival to the look. Allocates nothing, throws
/// nothing.
class ArrivalClock {
 public:
  /// Longest time that a packet may have waited in the kernel or in LCM's queue before the previous
  /// look.
  static constexpr std::int64_t kLongestWait_ns = 100'000'000;

  /// The first `look`.
  explicit ArrivalClock(ClockPair now = read_clocks()) noexcept;

  /// Takes both clocks, read together. Packets passed to `arrival_ns` from here on arrived by
  /// `now`.
  void look(ClockPair now = read_clocks()) noexcept;

  /// Arrival of a packet stamped `stamp_us`, in ns of the monotonic clock. Call in order of
  /// arrival; the results do not decrease. For an impossible stamp it is the time of the look.
  std::int64_t arrival_ns(std::int64_t stamp_us) noexcept;

 private:
  std::int64_t look_ns_, look_before_ns_ = 0;
  std::int64_t wall_minus_ns_, wall_minus_before_ns_ = 0;
  std::int64_t newest_ns_ = kNever;
};

}  // namespace softarm
