// The tick's thread on a Linux machine: monotonic clock, absolute deadlines, scheduling, memory.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "softarm/daemon/settings.hpp"

namespace softarm {

/// CLOCK_MONOTONIC in ns.
std::int64_t monotonic_now_ns() noexcept;

/// Sleeps until an absolute time of CLOCK_MONOTONIC; returns early when a signal arrives.
void sleep_until_ns(std::int64_t deadline_ns) noexcept;

/// Applies scheduling, pinning and memory locking to the calling thread and process; with locked
/// memory 256 KiB of the calling thread's stack are there already, so that they cause no page fault
/// later. The thread's sleeps end when they are due, to 1 ns instead of the usual 50 us, under any
/// scheduling. What the machine does not permit is left undone and reported: one line each, with
/// the cure.
std::vector<std::string> apply_realtime_settings(const RealtimeSettings& settings);

/// Whether the calling thread runs under SCHED_FIFO.
bool runs_under_fifo() noexcept;

/// Absolute deadlines at a fixed period. Missed ones are skipped, never caught up with.
class PeriodicDeadline {
 public:
  /// @param period_ns > 0  @param first_ns time of the first deadline
  PeriodicDeadline(std::int64_t period_ns, std::int64_t first_ns) noexcept
      : period_ns_(period_ns), next_ns_(first_ns) {}

  std::int64_t next_ns() const noexcept { return next_ns_; }

  /// To be called after the work of a deadline; returns how many deadlines were missed and skipped.
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

/// Another process holds the lock.
class OtherInstance : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What instances on an LCM channel lock: neither the options behind the '?' of a URL nor another
/// spelling of group and port make another network.
std::string lock_name(const std::string& channel, const std::string& url);

/// Held for the life of the process: keeps a second instance away from the same name. No file is
/// left behind.
class InstanceLock {
 public:
  /// @throws OtherInstance; std::runtime_error if no lock can be taken at all
  explicit InstanceLock(const std::string& name);
  ~InstanceLock();
  InstanceLock(const InstanceLock&) = delete;
  InstanceLock& operator=(const InstanceLock&) = delete;

 private:
  int socket_ = -1;
};

}  // namespace softarm
