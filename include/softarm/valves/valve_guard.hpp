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
  shutdown
};
/// Name in messages, in static storage; empty for none.
const char* name(ValveReason reason) noexcept;

/// What the driver does next.
enum class ValveAction {
  wait,     ///< nothing
  connect,  ///< then `connected`
  secure,   ///< set the terminal's time-out and read it back, then `secured`
  exchange  ///< write `set_points_bar`, read pressures back, then `exchanged`
};

/// Configuration of the guard.
struct ValveGuardSettings {
  ValveDriverSettings driver;
  int chambers = 1;  ///< >= 1
  double max_pressure_bar = 2.0;
  double rise_bar_per_s = 8.0;      ///< of set points on the way from vented to what is commanded
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
};

/// Time is an argument (ns of a monotonic clock that never goes back). Once a cycle: `wake`, the
/// commands that came, `next`, `wake` once more before an exchange, and the result of the action.
/// Never throws or allocates after construction.
class ValveGuard {
 public:
  /// Starts disconnected.
  explicit ValveGuard(const ValveGuardSettings& settings);

  /// At the start of a cycle, and right before pressures are written: a decision made before a gap
  /// in time does not apply to a terminal that may have vented meanwhile. False after a gap:
  /// everything in queues is too old and must be discarded.
  bool wake(std::int64_t now_ns) noexcept;

  /// By the rules of CommandExpiry.
  CommandVerdict command(const PressureCommand& command, std::int64_t arrival_ns) noexcept {
    return expiry_.receive(command, arrival_ns);
  }

  /// The action to take now; report its result by `connected`, `secured` or `exchanged`.
  ValveAction next(std::int64_t now_ns) noexcept;
  /// Result of connecting; after a failure the next attempt waits for the back-off time.
  void connected(bool success, std::int64_t now_ns) noexcept;
  /// @param as_written the time-out read back equals the one that was set.
  void secured(LinkResult result, bool as_written, std::int64_t now_ns) noexcept;
  /// `read_back` counts only if `result` is ok.
  void exchanged(LinkResult result, const ReadBack& read_back, std::int64_t now_ns) noexcept;

  /// From now on every set point is zero.
  void stop() noexcept;
  /// The last thing written to a terminal was zero for every valve and read back as such (where set
  /// points can be read back), or nothing else was ever written.
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
  /// Set points to write (bar, one per chamber), within [0, max_pressure_bar]; zero unless running.
  const Eigen::VectorXd& set_points_bar() const noexcept { return set_points_bar_; }
  /// Counters since construction.
  const ValveCounters& counters() const noexcept { return counters_; }

 private:
  void enter(ValveState state, ValveReason reason) noexcept;
  void disconnect(ValveReason reason, std::int64_t now_ns) noexcept;
  void degrade(ValveReason reason, int chamber) noexcept;
  void failed(LinkResult result, std::int64_t now_ns) noexcept;
  ValveReason fault(const ReadBack& read_back, int& chamber) const noexcept;
  int stuck_chamber(const ReadBack& read_back, std::int64_t now_ns) noexcept;
  void wait_for_zero() noexcept;
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
  std::int64_t failing_since_ns_ = 0;  ///< the first of `failures_`
  std::int64_t written_ns_ = kNever;
  std::int64_t listening_since_ns_ = kNever;  ///< for commands of zero, or none
  std::int64_t answered_ns_ = 0;              ///< the cycle of the newest exchange that went well
  int failures_ = 0;                          ///< in a row
  int good_cycles_ = 0;                       ///< in a row
  bool must_see_zero_;
  bool rising_ = true;  ///< on the way from vented to what is commanded
  bool stopping_ = false;
  bool zero_confirmed_ = true;
  Eigen::VectorXd set_points_bar_;
  std::vector<std::int64_t> off_since_ns_;  ///< kNever while a chamber follows its set point
  ValveCounters counters_;
};

}  // namespace softarm
