// The clocks of this machine, and deadlines on the monotonic one.
#pragma once

#include <time.h>

#include <cstdint>

namespace softarm {

/// CLOCK_MONOTONIC in ns.
std::int64_t monotonic_now_ns() noexcept;
/// Processor time of this thread in ns.
std::int64_t thread_cpu_ns() noexcept;

/// The monotonic and the wall clock (CLOCK_REALTIME) at one instant, in ns.
struct ClockPair {
  std::int64_t monotonic_ns, wall_ns;
};

/// Reads both clocks together: the best of a few attempts, the one with the shortest time between
/// the two readings.
ClockPair read_clocks() noexcept;

/// Notices pauses in which CLOCK_MONOTONIC stood still: the machine was suspended, or its virtual
/// machine was paused by a host that reports it. CLOCK_BOOTTIME then goes on, so the difference of
/// the two changes; nothing else changes it. A pause that neither clock counts cannot be seen here.
class PauseWatch {
 public:
  PauseWatch() noexcept;
  /// Whether there was a pause since the last call (at first: since construction).
  bool paused() noexcept;

 private:
  /// Bounds of CLOCK_BOOTTIME minus CLOCK_MONOTONIC in ns: they are never read at one instant.
  struct Difference {
    std::int64_t least_ns, most_ns;
  };
  static Difference read() noexcept;

  Difference known_;
};

/// CLOCK_REALTIME in ns since 1970: the only clock that two machines, or two boots of one machine,
/// share. It may be set at any time, also backwards.
std::int64_t wall_now_ns() noexcept;

/// Sleeps until an absolute time of CLOCK_MONOTONIC; returns early when a signal arrives.
void sleep_until_ns(std::int64_t deadline_ns) noexcept;

/// Time left until `deadline_ns` of CLOCK_MONOTONIC, at least zero: the timeout of ppoll.
timespec time_left(std::int64_t deadline_ns) noexcept;

/// Absolute deadlines at a fixed period. Missed deadlines are skipped, never caught up with.
class PeriodicDeadline {
 public:
  /// @param period_ns > 0  @param first_ns time of the first deadline
  PeriodicDeadline(std::int64_t period_ns, std::int64_t first_ns) noexcept
      : period_ns_(period_ns), next_ns_(first_ns) {}

  /// The next deadline, in the clock of `first_ns`.
  std::int64_t next_ns() const noexcept { return next_ns_; }

  /// Call after the work of a deadline. Returns how many deadlines were missed and skipped.
  std::int64_t advance(std::int64_t now_ns) noexcept {
    next_ns_ += period_ns_;
    if (now_ns <= next_ns_) return 0;
    const std::int64_t missed = (now_ns - next_ns_) / period_ns_ + 1;
    next_ns_ += missed * period_ns_;
    return missed;
  }

 private:
  std::int64_t period_ns_;
  std::int64_t next_ns_;
};

}  // namespace softarm
