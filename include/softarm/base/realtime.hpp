// How a thread that must not be late runs on Linux: scheduling, processor, memory.
#pragma once

#include <string>
#include <vector>

namespace softarm {

/// Scheduling of the thread that calls apply_realtime_settings.
struct RealtimeSettings {
  bool fifo = false;
  int priority = 50;
  int cpu = -1;  ///< pin the tick's thread; -1: do not
  bool lock_memory = false;
};

/// Applies scheduling, pinning and memory locking to the calling thread and process; with locked
/// memory 256 KiB of the calling thread's stack are there already, so that they cause no page fault
/// later. The thread's sleeps end when they are due, to 1 ns instead of the usual 50 us, under any
/// scheduling. What the machine does not permit is left undone and reported: one line each, with
/// the cure.
std::vector<std::string> apply_realtime_settings(const RealtimeSettings& settings);

/// Whether the calling thread runs under SCHED_FIFO.
bool runs_under_fifo() noexcept;

}  // namespace softarm
