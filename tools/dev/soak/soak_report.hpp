// What a soak counted, and what of it is a failure.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "dev/soak/process_use.hpp"

namespace softarm {

/// By so much the anonymous memory of a process may grow after the warm-up, KiB: what glib and the
/// C library still take in large steps. A leak of one byte a tick is 1.7 MiB in an hour at 500 Hz.
inline constexpr std::int64_t kMostGrowth_kib = 512;

struct FaultCount {
  std::string name;
  int injected = 0;
  int answered = 0;   ///< the demanded reaction was seen
  int recovered = 0;  ///< ACTIVE again afterwards
  /// Although nothing should have happened to the arm, ACTIVE was left: a busy machine does that.
  int disturbed = 0;
  double longest_answer_s = 0.0, longest_recovery_s = 0.0;
};

/// A process from the end of the warm-up to the end of the run.
struct ProcessRecord {
  std::string name;
  ProcessUse at_start, after_warm_up, at_end;
  int instances = 1;
  bool measured = false;  ///< it was there at both ends
};

struct SoakCounters {
  double duration_s = 0.0;
  double warm_up_s = 0.0;  ///< memory and descriptors are compared from here on
  double rate_hz = 0.0;
  std::int64_t ticks = 0;
  std::int64_t overruns = 0;
  std::int64_t overruns_while_stopped = 0;  ///< of them while the daemon was stopped by SIGSTOP
  std::int64_t commands = 0, commands_outside_limits = 0;
  std::int64_t straight_poses = 0;  ///< SoakArm::straight_poses
  int unprovoked = 0;               ///< ACTIVE was left with no fault there
  std::vector<FaultCount> faults;
  std::vector<ProcessRecord> processes;
  /// Processes that ended by themselves or with another exit code than 0, exceptions: a line each.
  std::vector<std::string> troubles;

  int injected() const;
  int recovered() const;
};

/// Why the run is a failure, a line each; empty if it is none.
std::vector<std::string> failures(const SoakCounters& counters);

/// For people, and for programs.
std::string report_text(const SoakCounters& counters);
std::string report_json(const SoakCounters& counters);

}  // namespace softarm
