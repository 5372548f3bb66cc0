// Replays a recorded run: the pipeline gets the recorded inputs and must give the recorded outputs.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "softarm/config/experiment.hpp"
#include "softarm/recording/field_comparison.hpp"
#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/transport/event_log.hpp"
#include "softarm/transport/output_messages.hpp"
#include "softarm/transport/tick_record.hpp"

namespace softarm {

/// Ticks [first, last] of a run of the daemon without a record in the log.
struct ReplayGap {
  std::int64_t first = 0, last = 0;
  std::int64_t position = 0;  ///< of the next record, in bytes in the log
  double time_s = 0.0;        ///< of the next record, since the first of the run
};

/// The first tick whose command or status differs from the recorded one.
struct ReplayDifference {
  std::int64_t run = 0, tick = 0;
  double time_s = 0.0;                  ///< since the run's first tick
  std::int64_t position = 0;            ///< of the recorded message, in bytes in the log
  std::vector<FieldDifference> fields;  ///< "command.pressure_bar[3]", "status.mode", ...
};

/// How many messages of one kind were compared, and how many of them differed.
struct ReplayCount {
  std::int64_t compared = 0, different = 0;
};

/// The result of a replay.
struct ReplaySummary {
  static constexpr std::size_t kGapsKept = 16;  ///< in `gaps`

  std::int64_t runs = 0;   ///< of a daemon
  std::int64_t ticks = 0;  ///< replayed
  double duration_s = 0.0;
  /// Commands as decided by the pipeline, commands as sent, and statuses, of the ticks whose whole
  /// past is in the log.
  ReplayCount records, commands, statuses;
  ReplayCount after_gap;  ///< records of ticks whose past is not complete: prove nothing
  std::int64_t agrees_again =
      -1;  ///< after the last gap: first tick from which all agree; -1: none
  std::int64_t missing_ticks = 0;  ///< ticks without a record
  std::int64_t gap_count = 0;
  std::vector<ReplayGap> gaps;  ///< the first kGapsKept
  std::int64_t malformed = 0;   ///< messages on our channels that could not be decoded
  bool other_build = false;     ///< another build than this one made the recording
  std::string recorded_build;   ///< of the first run; empty: not recorded
  ReplayDifference first;       ///< if there is one

  /// Whether any message differed.
  bool different() const { return !first.fields.empty(); }
  /// Whether every tick from the first one was in the log, was replayed and was the same.
  bool complete() const { return ticks > 0 && gap_count == 0 && malformed == 0 && !different(); }
};

/// The log was recorded with another configuration; what() gives both hashes.
class OtherConfiguration : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Takes the events of a log in order and compares the recorded commands and statuses with those
/// that the pipeline computes from the records of the same ticks. Memory does not grow with the
/// length of the log.
class Replay {
 public:
  /// @param build  of this program, see build_text()
  /// @param any_configuration  also replay a recording of another configuration
  Replay(const Experiment& experiment, std::string build, bool any_configuration);

  /// Takes the next event. @throws OtherConfiguration
  void take(const LogEvent& event);
  /// Call once, after the last event.
  void finish();

  /// The result; complete after finish().
  const ReplaySummary& summary() const { return summary_; }

 private:
  static constexpr std::size_t kWindow = 256;  ///< ticks that may wait for others
  /// A tick that has not come after so many later ones is missing: its repetition is overdue.
  static constexpr std::int64_t kPatience = TickRecorder::kRepeatAfter + 14;

  template <class Message>
  struct Waiting {
    std::int64_t tick = 0, position = 0;  ///< tick 0: an empty place
    Message message;
  };
  using WaitingRecord = Waiting<softarm_messages::tick_record_t>;
  /// Messages of one kind, by their tick.
  template <class Message>
  struct Window {
    Waiting<Message>& at(std::int64_t tick) {
      return (*places)[static_cast<std::size_t>(tick) % kWindow];
    }
    using Places = std::array<Waiting<Message>, kWindow>;
    std::unique_ptr<Places> places = std::make_unique<Places>();
    Waiting<Message> incoming;
  };

  template <class Message, class Tick>
  void keep(const LogEvent& event, Window<Message>& window, Tick tick_of);
  void take_record(const LogEvent& event);
  bool fits(const softarm_messages::tick_record_t& record) const;
  void begin_run(const softarm_messages::tick_record_t& first);
  void end_run();
  void advance(std::int64_t patience);
  void add_gap(std::int64_t first, std::int64_t last, const WaitingRecord& next);
  void run(const WaitingRecord& record);
  void compare(const WaitingRecord& record);
  template <class Message>
  void compare_waiting(Window<Message>& window, const WaitingRecord& record, Message& replayed,
                       const char* name, ReplayCount& count);
  void note(std::vector<FieldDifference> fields, const WaitingRecord& record, std::int64_t position,
            const char* message);
  void check_build(const std::string& recorded);

  Experiment experiment_;
  std::string build_;
  bool any_configuration_;
  bool by_torque_;
  std::unique_ptr<ControlPipeline> pipeline_;
  std::unique_ptr<OutputMessages> messages_;
  RecordedInput input_;
  std::vector<double> command_;

  Window<softarm_messages::tick_record_t> records_;
  Window<softarm_messages::pressure_command_t> pressures_;
  Window<softarm_messages::torque_command_t> torques_;
  Window<softarm_messages::controller_status_t> statuses_;

  bool running_ = false;
  bool exact_ = false;         ///< every tick of this run so far was in the log
  std::int64_t first_ns_ = 0;  ///< of this run
  std::int64_t next_ = 1;      ///< tick to be replayed next
  std::int64_t newest_ = 0;    ///< tick of the newest record
  std::int64_t last_ns_ = 0;
  ReplaySummary summary_;
};

}  // namespace softarm
