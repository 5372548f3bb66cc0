// What softarmd prints of its loop while it runs: each thing once it changes, at most once a second
// where anyone on the network may cause it.
#pragma once

#include <cstdint>
#include <optional>

#include "softarm/base/line_log.hpp"
#include "softarm/base/time.hpp"
#include "softarm/transport/daemon_loop.hpp"
#include "softarm/transport/input_report.hpp"

namespace softarm {

class LoopReports {
 public:
  /// Both outlive it. @param lcm names of channels
  LoopReports(const DaemonLoop& loop, const LcmSettings& lcm, LineLog& log)
      : loop_(loop), lcm_(lcm), log_(log), held_us_(loop.link().asked_us()) {}

  /// All of what is below. @param mode now
  void report(std::int64_t now_ns, Mode mode);

  /// Messages and frames that were refused or left out since the last line about it.
  void report_refused(std::int64_t now_ns);

 private:
  void report_streams(std::int64_t now_ns, Mode mode);
  void report_mocap();
  void report_validity();

  const DaemonLoop& loop_;
  const LcmSettings& lcm_;
  LineLog& log_;
  InputReport inputs_;
  std::int64_t refused_ = 0, left_out_ = 0, refused_reported_ns_ = kNever;
  std::optional<MocapStanding> standing_;
  std::int32_t held_us_;
};

}  // namespace softarm
