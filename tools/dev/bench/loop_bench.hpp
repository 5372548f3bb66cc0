// softarm-dev bench loop: what the real softarmd adds to LCM and to the kernel's timers.
//
// Round trip: from the sending of a motion-capture frame to the arrival of the command that was
// computed from it, less the deliberate wait of a frame that came before its tick was due. The
// tick's lateness, decoding, estimation, control and publishing count; the rival is a process that
// answers a message of a frame's size with one of a command's.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "dev/bench/model_report.hpp"

namespace softarm {

struct LoopBenchOptions {
  std::string config;     ///< whose arm it is
  double seconds = 20.0;  ///< of each scene
  double rate_hz = 1000.0;
  int busy_processes = 3;  ///< of the loaded scene
  int cpu = -1;            ///< on which daemon, echo and sleeper run; -1: any
  bool law = false;        ///< a control law in another process
};

struct Durations {
  std::int64_t count = 0;
  double p50_us = 0.0, p99_us = 0.0, largest_us = 0.0;  ///< NaN where there are none
};

/// Daemon and rivals under the same scheduling, at the same time.
struct LoopScene {
  std::string name{};
  bool fifo = false;
  int busy_processes = 0;
  std::string skipped{};                     ///< why nothing was measured; empty: it was
  Durations echo{};                          ///< the bare echo's round trip
  Durations command{};                       ///< the daemon's, without the wait
  Durations wait{};                          ///< until the tick was due
  Durations whole{};                         ///< the daemon's round trip, the wait included
  Durations law{};                           ///< from a state to the arrival of the law's answer
  Durations bare_lateness{}, lateness{};     ///< of wake-ups after their deadline
  std::int64_t bare_missed = 0, missed = 0;  ///< deadlines
  std::int64_t missed_asleep = 0;  ///< of the daemon's: before it woke, as all of the bare sleep's
  double stolen_s = 0.0;           ///< processor time the host gave to others; NaN: not known
  std::int64_t unanswered = 0;     ///< frames without a command, requests without an echo

  double round_trip_p50_ratio() const { return command.p50_us / echo.p50_us; }
  double round_trip_p99_ratio() const { return command.p99_us / echo.p99_us; }
  double lateness_p99_ratio() const { return lateness.p99_us / bare_lateness.p99_us; }
};

struct LoopReport {
  BenchBuild build;
  double seconds = 0.0, rate_hz = 0.0;
  int frame_bytes = 0, command_bytes = 0;
  std::vector<LoopScene> scenes;
};

/// @throws ConfigError, TransportError; std::runtime_error if the daemon does not become ACTIVE
LoopReport bench_loop(const LoopBenchOptions& options,
                      const std::function<void(const std::string&)>& progress);

std::string table(const LoopReport& report);
std::string json(const LoopReport& report);

}  // namespace softarm
