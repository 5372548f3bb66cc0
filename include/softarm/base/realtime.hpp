// Scheduling, CPU pinning and memory locking of a real-time thread on Linux.
#pragma once

#include <string>
#include <vector>

namespace softarm {

/// Scheduling of the thread that calls apply_realtime_settings.
struct RealtimeSettings {
  bool fifo = false;         ///< schedule under SCHED_FIFO
  int priority = 50;         ///< of SCHED_FIFO, 1 to 99
  int cpu = -1;              ///< pin the thread of the tick to this CPU; -1: do not
  bool lock_memory = false;  ///< mlockall
};

/// Applies scheduling, pinning and memory locking to the calling thread and process. With locked
/// memory, 256 KiB of the calling thread's stack are touched in advance, so that they cause no page
/// fault later. Under any scheduling, the timer slack of the thread's sleeps is reduced from the
/// usual 50 us to 1 ns. What the machine does not permit is left undone and returned: one line
/// each, with the fix.
std::vector<std::string> apply_realtime_settings(const RealtimeSettings& settings);

/// Whether the calling thread runs under SCHED_FIFO.
bool runs_under_fifo() noexcept;

}  // namespace softarm
