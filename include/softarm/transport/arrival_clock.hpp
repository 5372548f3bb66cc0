// When did a packet arrive, on our monotonic clock? LCM stamps it with the wall clock.
#pragma once

#include <cstdint>

#include "softarm/base/time.hpp"

namespace softarm {

/// Brings LCM's receive stamps (the kernel's wall clock, as the packet came in) to our monotonic
/// clock. The difference of the clocks is read at every look. Where the wall clock was set between
/// two looks, a stamp belongs to the clock before or after, and the later arrival of those that can
/// be true counts: a clock that is set never makes a packet older than it is, and younger by no
/// more than the time from its arrival to the look. Allocates nothing, throws nothing, reads no
/// clock.
class ArrivalClock {
 public:
  /// For so long a packet may have waited, in the kernel or in LCM's queue, before the look before.
  static constexpr std::int64_t kLongestWait_ns = 100'000'000;

  /// As `look`, for the first time.
  ArrivalClock(std::int64_t monotonic_ns, std::int64_t wall_ns) noexcept;

  /// Both clocks, read together. What is asked about from here on has arrived by `monotonic_ns`.
  void look(std::int64_t monotonic_ns, std::int64_t wall_ns) noexcept;

  /// The arrival of a packet stamped `stamp_us`, asked about in order of arrival: does not
  /// decrease. That of the look for a stamp that cannot be true.
  std::int64_t arrival_ns(std::int64_t stamp_us) noexcept;

 private:
  std::int64_t look_ns_, look_before_ns_ = 0;
  std::int64_t wall_minus_ns_, wall_minus_before_ns_ = 0;
  std::int64_t newest_ns_ = kNever;
};

}  // namespace softarm
