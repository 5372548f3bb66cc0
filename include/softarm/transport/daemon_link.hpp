// The daemon's side of LCM: inputs since the last tick, and outputs after it.
#pragma once

#include <cstdint>
#include <optional>
#include <softarm_messages/curvature_reference_t.hpp>
#include <softarm_messages/deadman_t.hpp>
#include <softarm_messages/law_command_t.hpp>
#include <softarm_messages/operator_command_t.hpp>
#include <softarm_messages/pressure_command_t.hpp>
#include <softarm_messages/pressure_measurement_t.hpp>
#include <softarm_messages/timing_t.hpp>
#include <softarm_messages/tip_target_t.hpp>
#include <softarm_messages/torque_command_t.hpp>
#include <vector>

#include "softarm/base/clock.hpp"
#include "softarm/base/histogram.hpp"
#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/mocap_source.hpp"
#include "softarm/transport/nonce.hpp"
#include "softarm/transport/output_messages.hpp"
#include "softarm/transport/sent_commands.hpp"
#include "softarm/transport/settings.hpp"
#include "softarm/transport/tick_record.hpp"

namespace softarm {

/// The four durations that the daemon measures, and its counters.
struct LoopTiming {
  DurationHistogram lateness;   ///< wake-up after the deadline
  DurationHistogram frame_age;  ///< capture of the newest frame to the tick
  DurationHistogram tick;       ///< from wake-up to the command
  DurationHistogram publish;    ///< publishing command and status
  DurationHistogram law;        ///< from a state to the arrival of an external law's answer to it
  std::int64_t ticks = 0;
  std::int64_t overruns = 0;  ///< deadlines missed
};

/// Collects the inputs of a tick and publishes its outputs. Use from the thread of the tick. After
/// construction nothing allocates, waits or throws.
///
/// Who may ask for what (docs/reference/requests.md): a request that vents is obeyed whatever else
/// the message says. An `arm`, a "go", and a disarm that leaves FAULT must echo the nonce of a recent
/// status, and an `arm` must be younger than every disarm and emergency stop.
class DaemonLink {
 public:
  /// @param shadow  mark commands as computed for inspection only
  /// @throws TransportError
  DaemonLink(const PipelineSettings& settings, const TransportSettings& transport,
             const Provenance& provenance, bool shadow);

  /// Handles the messages that have arrived, a bounded number. The frames that the result points to
  /// are valid until the next call.
  TickInput collect(std::int64_t now_ns) noexcept;

  /// Publishes pressures, or torques where actuation is by torque (another type, which no valve
  /// terminal decodes). If the previous command expired while this one was being decided, it is not
  /// sent, because it would be a step up from vented valves; the next tick is informed by
  /// TickInput::command_expired.
  void publish_command(std::int64_t now_ns, const TickOutput& output) noexcept;
  /// Publishes what an external law is to answer, if the tick has it. A shadow does not.
  void publish_law_state(std::int64_t now_ns, const TickOutput& output) noexcept;
  /// Publishes the status of the tick, with overruns from `timing`; `show` is false where it is too
  /// early to show it.
  void publish_status(std::int64_t now_ns, const ControlPipeline& pipeline,
                      const LoopTiming& timing, bool show = true) noexcept;
  /// Publishes the histograms of `timing`.
  void publish_timing(std::int64_t now_ns, const LoopTiming& timing) noexcept;
  /// Publishes the inputs of the tick of the last command, and again the record of
  /// TickRecorder::kRepeatAfter ticks ago. Does nothing if no channel is configured for it.
  void publish_record(const TickInput& input, const TickOutput& output) noexcept;
  /// Repeats the oldest record that has been sent only once; false if there is none. For the end of
  /// a run, when no tick follows.
  bool repeat_record() noexcept;

  /// Nonce of the status of this instant.
  std::int64_t nonce(std::int64_t now_ns) const noexcept { return nonces_.at(now_ns / 1000); }
  /// How long the valves hold a command of ours (us): its validity, or less where they grant less.
  std::int32_t held_us() const noexcept;
  /// The validity that commands ask for (us).
  std::int32_t asked_us() const noexcept { return messages_.pressure_command.validity_us; }
  /// Messages that could not be decoded.
  std::int64_t malformed() const noexcept { return malformed_; }
  /// Measurements older by their sender's clock than the one before: two senders, or a restart.
  std::int64_t backward_measurements() const noexcept { return backward_measurements_; }
  /// References with a number that is not above the newest.
  std::int64_t backward_references() const noexcept { return backward_references_; }
  /// How far the connection to a motion-capture server is; none over LCM.
  std::optional<MocapStanding> mocap_standing() const noexcept { return mocap_.standing(); }
  /// Live references and targets of the tip, those refused before the pipeline included.
  VerdictCounts<kLiveVerdicts> live_counts(const ControlPipeline& pipeline) const noexcept {
    return sum(pipeline.reference_counts(), references_refused_);
  }
  /// The same of answers of an external law.
  VerdictCounts<kLawVerdicts> law_counts(const ControlPipeline& pipeline) const noexcept {
    return sum(pipeline.law_counts(), law_refused_);
  }
  /// Publications that failed, and commands that were too late to send.
  std::int64_t unsent() const noexcept { return unsent_; }

 private:
  void take_frame(std::size_t channel, const ReceivedMessage& packet) noexcept;
  void receive_frames() noexcept;
  void take_reference(const ReceivedMessage& packet) noexcept;
  void take_tip_target(const ReceivedMessage& packet) noexcept;
  void take_law(const ReceivedMessage& packet) noexcept;
  void take_operator(const ReceivedMessage& packet) noexcept;
  void take_measurement(const ReceivedMessage& packet) noexcept;
  void take_valves_report() noexcept;
  void take_go(const ReceivedMessage& packet) noexcept;
  void take_command(const ReceivedMessage& packet) noexcept;
  template <class Counts>
  static Counts sum(Counts a, const Counts& b) noexcept {
    for (std::size_t k = 0; k < a.size(); ++k) a[k] += b[k];
    return a;
  }
  bool requests_lost(std::int64_t previous_ns) noexcept;
  bool is_recent(std::int64_t nonce, std::int64_t since_us) const noexcept;
  std::int64_t arrival_ns(const ReceivedMessage& packet) const noexcept;
  bool command_expired(std::int64_t now_us) const noexcept;

  LcmSettings lcm_;
  MocapSource mocap_;
  LcmNode node_;
  int dof_;
  OutputMessages messages_;
  std::optional<TickRecorder> recorder_;

  // Filled by the handlers during collect().
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
  std::int64_t reference_sequence_;
  TipTargetInput tip_target_;
  std::int64_t newest_tip_ns_ = kNever;
  std::int64_t tip_sequence_ = kNever;
  LawInput law_;
  std::int64_t newest_law_ns_ = kNever;
  std::int64_t law_sequence_ = kNever;
  VerdictCounts<kLawVerdicts> law_refused_{};
  VerdictCounts<kLiveVerdicts> references_refused_{};
  std::int64_t newest_foreign_ns_ = kNever;
  int requests_ = 0, goes_ = 0;  ///< since the last tick
  bool released_ = false;        ///< the dead-man input, since the last tick

  // What an `arm` must be younger than.
  NonceClock nonces_;
  Mode mode_ = Mode::init;           ///< of the newest status
  std::int64_t vented_us_ = kNever;  ///< a disarm, a stop, or the beginning of VENT or FAULT
  std::int64_t fault_us_ = kNever;   ///< the newest emergency stop, or the beginning of FAULT
  std::int64_t newest_request_ns_ = kNever;
  std::int64_t newest_sequence_ = kNever;   ///< of all requests
  std::int64_t refused_ns_ = kNever;        ///< the newest disarm or stop
  std::int64_t refused_sequence_ = kNever;  ///< up to this number an `arm` is older than that

  std::int64_t stopped_ns_ = kNever;  ///< end of the last stop of this process
  std::int64_t dropped_ = 0;          ///< packets by the socket
  SentCommands sent_;
  std::int64_t commands_ = 0;
  std::int64_t sent_us_ = kNever;  ///< time in the newest command
  PauseWatch pause_;
  bool paused_while_deciding_ = false;
  bool valve_readback_ = false;
  // What the valves have reported.
  bool valves_vented_ = false;
  std::int32_t valves_expired_ = 0, granted_us_ = 0;
  std::int64_t valves_heard_ns_ = kNever;
  std::int64_t malformed_ = 0;
  std::int64_t measurement_time_us_ = kNever;
  std::int64_t backward_measurements_ = 0, backward_references_ = 0;
  std::int64_t unsent_ = 0;

  softarm_messages::curvature_reference_t reference_message_;
  softarm_messages::operator_command_t operator_message_;
  softarm_messages::pressure_measurement_t measurement_message_;
  softarm_messages::deadman_t deadman_message_;
  softarm_messages::pressure_command_t heard_pressures_;
  softarm_messages::torque_command_t heard_torques_;
  softarm_messages::timing_t timing_message_;
  softarm_messages::tip_target_t tip_message_{};
  softarm_messages::law_command_t law_message_;
};

}  // namespace softarm
