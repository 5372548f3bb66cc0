// The daemon's side of LCM: what came in since the last tick, and what goes out after it.
#pragma once

#include <cstdint>
#include <optional>
#include <softarm_messages/curvature_reference_t.hpp>
#include <softarm_messages/deadman_t.hpp>
#include <softarm_messages/operator_command_t.hpp>
#include <softarm_messages/pressure_measurement_t.hpp>
#include <softarm_messages/timing_t.hpp>
#include <vector>

#include "softarm/base/histogram.hpp"
#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/mocap_source.hpp"
#include "softarm/transport/output_messages.hpp"
#include "softarm/transport/settings.hpp"
#include "softarm/transport/tick_record.hpp"

namespace softarm {

/// The four durations the daemon measures of itself.
struct LoopTiming {
  DurationHistogram lateness;   ///< wake-up after the deadline
  DurationHistogram frame_age;  ///< capture of the newest frame to the tick
  DurationHistogram tick;       ///< from wake-up to the command
  DurationHistogram publish;    ///< publishing command and status
  std::int64_t ticks = 0;
  std::int64_t overruns = 0;
};

/// Belongs to the tick's thread. After construction nothing here allocates, waits or throws.
class DaemonLink {
 public:
  /// @throws TransportError
  DaemonLink(const PipelineSettings& settings, const TransportSettings& transport,
             const Provenance& provenance, bool shadow);

  /// Handles what has arrived, a bounded number of messages. The frames it points to live until the
  /// next call.
  TickInput collect(std::int64_t now_ns) noexcept;

  /// Pressures, or torques where these actuate: another type, which no valve terminal decodes. What
  /// was decided before the command before it expired, and comes after that, is not sent: it would
  /// be a step up from vented valves. The next tick hears of it (TickInput::command_expired).
  void publish_command(std::int64_t now_ns, const TickOutput& output) noexcept;
  void publish_status(std::int64_t now_ns, const ControlPipeline& pipeline,
                      const LoopTiming& timing) noexcept;
  void publish_timing(std::int64_t now_ns, const LoopTiming& timing) noexcept;
  /// What the tick of the last command was given, and the record of TickRecorder::kRepeatAfter
  /// ticks ago once more. Nothing where no channel is configured for it.
  void publish_record(const TickInput& input, const TickOutput& output) noexcept;
  /// Sends the oldest record that has been sent only once; false if there is none. For the end,
  /// when no tick follows.
  bool repeat_record() noexcept;

  /// Messages refused before decoding; publications that failed, and commands that came too late.
  std::int64_t malformed() const noexcept { return malformed_; }
  std::int64_t unsent() const noexcept { return unsent_; }

 private:
  void take_frame(std::size_t channel, const ReceivedMessage& packet) noexcept;
  void take_reference(const ReceivedMessage& packet) noexcept;
  void take_operator(const ReceivedMessage& packet) noexcept;
  void take_measurement(const ReceivedMessage& packet) noexcept;
  void take_go(const ReceivedMessage& packet) noexcept;
  std::int64_t arrival_ns(const ReceivedMessage& packet) const noexcept;
  bool command_expired(std::int64_t now_us) const noexcept;

  LcmSettings lcm_;
  MocapSource mocap_;
  LcmNode node_;
  int dof_;
  OutputMessages messages_;
  std::optional<TickRecorder> recorder_;

  // What the handlers fill during collect().
  std::vector<MocapFrame> frames_;
  std::size_t frame_count_ = 0;
  LiveReferenceInput reference_;
  TickInput input_;
  std::int64_t now_ns_ = 0;
  std::int64_t newest_measurement_ns_;
  std::int64_t newest_go_ns_;
  std::int64_t go_sequence_;
  PressureVector measured_bar_;
  std::int64_t newest_reference_ns_ = kNever;
  std::int64_t newest_operator_ns_ = kNever;
  std::int64_t reference_sequence_;
  std::int64_t operator_sequence_;
  std::int64_t commands_ = 0;
  std::int64_t sent_us_ = kNever;  ///< the newest command, as it says itself
  std::int64_t malformed_ = 0;
  std::int64_t unsent_ = 0;

  softarm_messages::curvature_reference_t reference_message_;
  softarm_messages::operator_command_t operator_message_;
  softarm_messages::pressure_measurement_t measurement_message_;
  softarm_messages::deadman_t deadman_message_;
  softarm_messages::timing_t timing_message_;
};

}  // namespace softarm
