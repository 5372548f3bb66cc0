// Decides what may be written to the valves and when they are not to be trusted: a state machine
// without sockets or clocks.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "softarm/actuation/command_expiry.hpp"
#include "softarm/base/time.hpp"
#include "softarm/valves/settings.hpp"
#include "softarm/valves/valve_backend.hpp"

namespace softarm {

/// State of the connection to the terminal, and what is written in it.
enum class ValveState : std::int8_t {
  disconnected,  ///< the terminal vents by its own time-out; the next attempt waits for the back-off
  securing,      ///< connected: that time-out is being set and read back; no pressure is written
  starting,      ///< set points of zero, until the terminal is ready and reads back well
  vented,        ///< set points of zero: no command is in force, or none may be
  running,       ///< the command in force is written
  degraded       ///< set points of zero: a fault was seen; left when all has been well for a while
};
/// Name in messages, in static storage.
const char* name(ValveState state) noexcept;

/// Why pressures are not what is commanded.
enum class ValveReason : std::int8_t {
  none,
  no_command,        ///< none came, or the last one expired
  no_connection,     ///< refused or lost
  no_answer,         ///< too late or not to the request, too often in a row
  exception_reply,   ///< the terminal refuses requests
  failsafe_refused,  ///< its time-out cannot be set, or reads back as something else
  not_ready,         ///< a slot does not regulate
  diagnosis,         ///< a valve reports a fault
  stuck_valve,       ///< a pressure does not follow its set point
  time_gap,          ///< the driver was not running for a while
  waiting_for_zero,  ///< until commands have been zero, or silent, once
  shutdown,
  other_sender,      ///< two programs command the arm
  echo_mismatch,     ///< the terminal holds other set points than were written
  failsafe_changed,  ///< its time-out is no longer what was set
  zero_unconfirmed,  ///< pressures do not fall: the driver is silent so that the terminal vents
  emergency_stop     ///< an operator's, until `acknowledge`
};
/// Name in messages, in static storage; empty for none.
const char* name(ValveReason reason) noexcept;

/// What the driver does next.
enum class ValveAction {
  wait,     ///< nothing, and nothing is sent
  connect,  ///< then `connected`
  secure,   ///< set the terminal's time-out and read it back, then `secured`
  exchange  ///< read back, `measured`; write `set_points_bar` if `may_write`, `written`
};

/// Configuration of the guard.
struct ValveGuardSettings {
  ValveDriverSettings driver;
  int chambers = 1;  ///< >= 1
  double max_pressure_bar = 2.0;
  double slew_bar_per_s = 40.0;     ///< of every rise, whoever commands it
  double rise_bar_per_s = 8.0;      ///< the same on the way from vented to what is commanded
  double longest_validity_s = 0.1;  ///< upper limit of a command's own validity
  bool wait_for_zero = false;  ///< after DEGRADED (and at first) commands must have been zero once
};

/// Counters since the start of the driver.
struct ValveCounters {
  std::int64_t cycles = 0;  ///< exchanges that went well
  std::int64_t connections = 0;
  std::int64_t exceptions = 0;
  std::int64_t no_answers = 0;
  std::int64_t broken = 0;  ///< connections lost
  std::int64_t times_degraded = 0;
  std::int64_t times_vented = 0;   ///< while a command was written
  std::int64_t other_senders = 0;  ///< commands of another sender than that of the one in force
};

/// Time is an argument (ns of a monotonic clock that never goes back). Once a cycle: `wake`, the
/// commands that came, `next`, and the result of its action; `wake` once more before a write. Never
/// throws or allocates after construction.
///
/// Trusts no terminal. What it holds is read before it is written again: a terminal that vented
/// while nobody counted the time, lost a write, or listens to another master is found by that.
/// Outside RUNNING the measured pressures must fall: below `vented_bar`, or to half within each
/// fail-safe time-out. Otherwise nothing is sent for 1.5 times as long, and the terminal vents by
/// itself.
class ValveGuard {
 public:
  /// Starts disconnected.
  explicit ValveGuard(const ValveGuardSettings& settings);

  /// At the start of a cycle, and right before pressures are written: a decision made before a gap
  /// in time does not apply to a terminal that may have vented meanwhile. `paused`: the monotonic
  /// clock stood still since the last call (PauseWatch). False after a gap: everything in queues is
  /// too old and must be discarded.
  bool wake(std::int64_t now_ns, bool paused = false) noexcept;

  /// By the rules of CommandExpiry. A command of another sender than that of the one in force
  /// vents, and is the reason of DEGRADED as long as they come.
  CommandVerdict command(const PressureCommand& command, std::int64_t arrival_ns) noexcept;

  /// The action to take now.
  ValveAction next(std::int64_t now_ns) noexcept;
  /// Result of connecting; after a failure the next attempt waits for the back-off time.
  void connected(bool success, std::int64_t now_ns) noexcept;
  /// @param as_written the time-out read back equals the one that was set.
  void secured(LinkResult result, bool as_written, std::int64_t now_ns) noexcept;
  /// Result of reading back; `read_back` counts only if it is ok.
  void measured(LinkResult result, const ReadBack& read_back, std::int64_t now_ns) noexcept;
  /// Whether the terminal's time-out is due to be read back in this cycle, after `measured`; then
  /// `failsafe_checked`. Once a second.
  bool failsafe_due(std::int64_t now_ns) const noexcept;
  /// Whether it must be set again for that.
  bool failsafe_lost() const noexcept { return failsafe_lost_; }
  void failsafe_checked(LinkResult result, bool as_set, std::int64_t now_ns) noexcept;
  /// Whether there is something to read back: not before the first write.
  bool may_read() const noexcept { return held_is_known_; }
  /// Whether to write in this cycle. Pressure is not written without a read-back before it.
  bool may_write() const noexcept;
  /// Result of writing `set_points_bar`.
  void written(LinkResult result, std::int64_t now_ns) noexcept;

  /// An operator's emergency stop: DEGRADED, now or once connected, until `acknowledge`, whoever
  /// commands. Then commands must have been zero, or silent, once.
  void emergency_stop() noexcept;
  /// An operator's disarm.
  void acknowledge() noexcept { emergency_stopped_ = false; }

  /// From now on every set point is zero.
  void stop() noexcept;
  /// Zero was written last, read back as such (where set points can be read back), and the measured
  /// pressures have fallen to `vented_bar`; or no terminal was ever reached.
  bool zero_confirmed() const noexcept { return zero_confirmed_; }

  /// State after the latest call.
  ValveState state() const noexcept { return state_; }
  /// Reason of the state.
  ValveReason reason() const noexcept { return reason_; }
  /// The chamber that DEGRADED, or a report of a stuck valve, refers to; -1: none.
  int chamber() const noexcept { return chamber_; }
  /// Sequence number of the command whose set points are written; CommandExpiry::kNoSequence: none.
  std::int64_t sequence() const noexcept {
    return state_ == ValveState::running ? expiry_.sequence() : CommandExpiry::kNoSequence;
  }
  /// The commands taken, with their validity.
  const CommandExpiry& commands() const noexcept { return expiry_; }
  /// Set points to write (bar, one per chamber), within [0, max_pressure_bar]; zero unless running.
  const Eigen::VectorXd& set_points_bar() const noexcept { return set_points_bar_; }
  /// Counters since construction.
  const ValveCounters& counters() const noexcept { return counters_; }

 private:
  friend struct ProofOfGuard;  ///< tests/proof: all of its state

  void enter(ValveState state, ValveReason reason) noexcept;
  void disconnect(ValveReason reason, std::int64_t now_ns) noexcept;
  void degrade(ValveReason reason, int chamber) noexcept;
  void failed(LinkResult result, std::int64_t now_ns) noexcept;
  ValveReason fault(const ReadBack& read_back, int& chamber) const noexcept;
  int mismatch(const ReadBack& read_back) const noexcept;
  int fallen_chamber(const ReadBack& read_back) noexcept;
  int stuck_chamber(const ReadBack& read_back, std::int64_t now_ns) noexcept;
  void note_venting(const ReadBack& read_back, std::int64_t now_ns) noexcept;
  void note_good_cycle() noexcept;
  bool exchanging() const noexcept { return state_ >= ValveState::starting; }
  void wait_for_zero(bool or_silence) noexcept;
  void update_running(std::int64_t now_ns) noexcept;
  void update_set_points(std::int64_t now_ns) noexcept;

  ValveGuardSettings settings_;
  std::int64_t period_ns_, failsafe_ns_, gap_ns_, first_backoff_ns_, longest_backoff_ns_,
      stuck_after_ns_;
  int good_cycles_needed_;
  std::int64_t validity_ns_;  ///< of a command, at most

  CommandExpiry expiry_;
  ValveState state_ = ValveState::disconnected;
  ValveReason reason_ = ValveReason::no_connection;
  int chamber_ = -1;
  std::int64_t woken_ns_ = kNever;
  std::int64_t next_attempt_ns_ = kNever;
  std::int64_t backoff_ns_;
  std::int64_t starting_since_ns_ = 0;
  std::int64_t written_ns_ = 0;
  std::int64_t listening_since_ns_ = kNever;  ///< for commands of zero, or none
  std::int64_t answered_ns_ = 0;              ///< the cycle of the newest exchange that went well
  std::int64_t venting_since_ns_ = 0;  ///< since the arm was vented, had halved, or was running
  double venting_from_bar_ = 0.0;      ///< largest measured pressure then
  std::int64_t failsafe_checked_ns_ = kNever;
  bool failsafe_lost_ = false;
  int failures_ = 0;                         ///< cycles in a row
  int good_cycles_ = 0;                      ///< in a row
  bool was_read_ = false, is_good_ = false;  ///< of the last read-back; it shows no fault
  bool must_see_zero_;
  bool silence_is_zero_ = true;
  bool rising_ = true;  ///< on the way from vented to what is commanded
  bool emergency_stopped_ = false;
  bool stopping_ = false;
  bool zero_confirmed_ = true;
  Eigen::VectorXd set_points_bar_;
  /// Set points that the terminal may hold: what was written, and more where no answer came.
  Eigen::VectorXd least_held_bar_, most_held_bar_;
  bool held_is_known_ = false;
  Eigen::VectorXd measured_bar_;            ///< at the last read-back
  std::vector<std::int64_t> off_since_ns_;  ///< kNever while a chamber follows its set point
  ValveCounters counters_;
};

}  // namespace softarm
