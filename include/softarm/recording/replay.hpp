// A recorded run once more: the pipeline is given what its ticks were given, and must say the same.
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

/// Ticks [first, last] of a run of the daemon that no record tells of.
struct ReplayGap {
  std::int64_t first = 0, last = 0;
  std::int64_t position = 0;  ///< in the log: of the record that follows
  double time_s = 0.0;        ///< of that record, since the run's first
};

/// The first tick whose command or status is not what was recorded.
struct ReplayDifference {
  std::int64_t run = 0, tick = 0;
  double time_s = 0.0;                  ///< since the run's first tick
  std::int64_t position = 0;            ///< of the recorded message in the log
  std::vector<FieldDifference> fields;  ///< "command.pressure_bar[3]", "status.mode", ...
};

/// What of a kind of message was compared, and how much of it differed.
struct ReplayCount {
  std::int64_t compared = 0, different = 0;
};

struct ReplaySummary {
  static constexpr std::size_t kGapsKept = 16;

  std::int64_t runs = 0;   ///< of a daemon
  std::int64_t ticks = 0;  ///< replayed
  double duration_s = 0.0;
  /// As the pipeline decided, as sent, and the status; of ticks whose whole past is in the log.
  ReplayCount records, commands, statuses;
  ReplayCount after_gap;           ///< records of ticks whose past is not: no proof of anything
  std::int64_t agrees_again = -1;  ///< after the last gap: first tick from which on all agree
  std::int64_t missing_ticks = 0;  ///< no record of them
  std::int64_t gap_count = 0;
  std::vector<ReplayGap> gaps;  ///< the first kGapsKept
  std::int64_t malformed = 0;   ///< messages on the channels read that are none
  bool other_build = false;     ///< than ours made the recording
  std::string recorded_build;   ///< of the first run; empty: not told
  ReplayDifference first;       ///< where there is one

  bool different() const { return !first.fields.empty(); }
  /// Every tick from the first on was there, was replayed and was the same.
  bool complete() const { return ticks > 0 && gap_count == 0 && malformed == 0 && !different(); }
};

/// The log was recorded with another configuration. what() names both hashes.
class OtherConfiguration : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Takes the events of a log in order. Commands and statuses are compared with what the pipeline
/// makes of the records of the same ticks; memory does not grow with the length of the log.
class Replay {
 public:
  /// @param build of this program, see build_text()
  /// @param any_configuration go on with a recording of another configuration
  Replay(const Experiment& experiment, std::string build, bool any_configuration);

  /// @throws OtherConfiguration
  void take(const LogEvent& event);
  /// To be called once, after the last event.
  void finish();

  const ReplaySummary& summary() const { return summary_; }

 private:
  static constexpr std::size_t kWindow = 256;  ///< ticks that wait for others
  /// Ticks after which one that has not come is missing: its repetition is overdue.
  static constexpr std::int64_t kPatience = TickRecorder::kRepeatAfter + 14;

  struct Waiting {  ///< tick 0: nothing waits here
    std::int64_t tick = 0, position = 0;
  };
  struct WaitingRecord : Waiting {
    softarm_messages::tick_record_t message;
  };
  struct WaitingPressures : Waiting {
    softarm_messages::pressure_command_t message;
  };
  struct WaitingTorques : Waiting {
    softarm_messages::torque_command_t message;
  };
  struct WaitingStatus : Waiting {
    softarm_messages::controller_status_t message;
  };
  template <class Kind>
  using Window = std::array<Kind, kWindow>;

  template <class Kind>
  static Kind& place(Window<Kind>& window, std::int64_t tick) {
    return window[static_cast<std::size_t>(tick) % kWindow];
  }
  template <class Kind, class Tick>
  void keep(const LogEvent& event, Window<Kind>& window, Kind& incoming, Tick tick_of);
  void take_record(const LogEvent& event);
  bool fits(const softarm_messages::tick_record_t& record) const;
  void begin_run(const softarm_messages::tick_record_t& first);
  void end_run();
  void advance(std::int64_t patience);
  void add_gap(std::int64_t first, std::int64_t last, const WaitingRecord& next);
  void run(const WaitingRecord& record);
  void compare(const WaitingRecord& record);
  template <class Kind, class Message>
  void compare_waiting(Window<Kind>& window, const WaitingRecord& record, Message& replayed,
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

  std::unique_ptr<Window<WaitingRecord>> records_;
  std::unique_ptr<Window<WaitingPressures>> pressures_;
  std::unique_ptr<Window<WaitingTorques>> torques_;
  std::unique_ptr<Window<WaitingStatus>> statuses_;
  WaitingRecord incoming_record_;
  WaitingPressures incoming_pressures_;
  WaitingTorques incoming_torques_;
  WaitingStatus incoming_status_;

  bool running_ = false;
  bool exact_ = false;         ///< every tick of this run so far was there
  std::int64_t first_ns_ = 0;  ///< of this run
  std::int64_t next_ = 1;      ///< tick to be replayed next
  std::int64_t newest_ = 0;    ///< tick of the newest record
  std::int64_t last_ns_ = 0;
  ReplaySummary summary_;
};

}  // namespace softarm
