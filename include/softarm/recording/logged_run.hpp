// Runs the daemon's pipeline on a recorded LCM log instead of an arm: the estimator on real data.
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
#include "softarm/transport/log_timeline.hpp"
#include "softarm/transport/mocap_source.hpp"

namespace softarm {

/// Ticks at whole control periods from the first motion-capture frame of the log; frames arrive at
/// their times on LogTimeline. Commands are computed but not sent; measured pressures and a person who arms
/// or holds a button are not needed (SimulatedOperator). Reads the log as it proceeds: memory does
/// not grow with its length.
class LoggedRun {
 public:
  /// @throws std::runtime_error if the log cannot be opened or contains no frame on the configured
  /// channel
  LoggedRun(const Experiment& experiment, const std::filesystem::path& log);

  /// Runs one tick; false at the end of the log. Fills `row` (except the true state, which is not
  /// known) only if the tick is `logged`.
  bool step(LogRow& row, bool logged = true);

  /// The pipeline after its latest tick.
  const ControlPipeline& pipeline() const { return pipeline_; }
  /// Computing times of the ticks.
  const DurationHistogram& tick_times() const { return tick_times_; }
  /// Messages on the motion-capture channel that could not be decoded.
  std::int64_t malformed() const { return malformed_; }

  /// What was done to the clock of the logger.
  const LogTimeline& timeline() const { return timeline_; }

  /// The log, for its damage; everything before and after damage was used.
  const EventLogReader& log() const { return log_; }

 private:
  bool read_frame();

  Experiment experiment_;
  ControlPipeline pipeline_;
  SimulatedOperator operator_;
  LogTimeline timeline_;
  MocapSource mocap_;
  EventLogReader log_;
  std::vector<MocapFrame> frames_;
  MocapFrame next_;  ///< read from the log, but not arrived yet
  std::int64_t next_arrival_ns_ = 0;
  bool has_next_ = false;
  std::int64_t start_ns_ = 0;
  std::int64_t ticks_ = 0;
  std::int64_t malformed_ = 0;
  DurationHistogram tick_times_;
};

}  // namespace softarm
