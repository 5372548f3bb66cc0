// The daemon's pipeline fed from a recorded LCM log instead of an arm: what the estimator makes of
// real data.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "softarm/base/histogram.hpp"
#include "softarm/config/experiment.hpp"
#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/runtime/log_row.hpp"
#include "softarm/simulation/simulated_operator.hpp"
#include "softarm/transport/event_log.hpp"
#include "softarm/transport/mocap_source.hpp"

namespace softarm {

/// Ticks at whole control periods from the log's first motion-capture frame on; frames arrive when
/// the log says they did. Commands are computed and go nowhere: no valve has to publish pressures,
/// and nobody has to arm or to hold a button (SimulatedOperator). Reads the log as it goes: memory
/// does not grow with its length.
class LoggedRun {
 public:
  /// @throws std::runtime_error if the log cannot be opened or holds no frame on the configured
  /// channel
  LoggedRun(const Experiment& experiment, const std::filesystem::path& log);

  /// One tick; false once the log is at its end. There is no truth to fill in, and nothing at all
  /// where the tick is not `logged`.
  bool step(LogRow& row, bool logged = true);

  const ControlPipeline& pipeline() const { return pipeline_; }
  const DurationHistogram& tick_times() const { return tick_times_; }
  std::int64_t malformed() const { return malformed_; }

  /// Tells what of the log is damaged or cut; what precedes and follows that was used.
  const EventLogReader& log() const { return log_; }

 private:
  bool read_frame();

  Experiment experiment_;
  ControlPipeline pipeline_;
  SimulatedOperator operator_;
  MocapSource mocap_;
  EventLogReader log_;
  std::vector<MocapFrame> frames_;
  MocapFrame next_;  ///< read from the log, not arrived yet
  std::int64_t next_arrival_ns_ = 0;
  bool has_next_ = false;
  std::int64_t start_ns_ = 0;
  std::int64_t ticks_ = 0;
  std::int64_t malformed_ = 0;
  DurationHistogram tick_times_;
};

}  // namespace softarm
