// The safety monitor: a pure state machine that decides, tick by tick, whether the arm may be
// moved.
#pragma once

#include <cstdint>
#include <limits>
#include <span>

#include "softarm/base/time.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {

/// What the daemon does with the valves. From `active` on in order of severity.
enum class Mode : std::int8_t {
  init,         ///< before the first tick
  wait_frames,  ///< vented, until good frames come and the arm is armed
  active,       ///< under control
  hold,         ///< pressures frozen
  vent,         ///< pressures ramp to zero and stay there
  fault         ///< like `vent`, and latched until an operator disarms
};

/// Reason of the mode; `cause_table` has what each demands and what clears it. The numbers go over
/// the wire: add new ones at the end.
enum class Reason : std::int8_t {
  none,
  starting,
  waiting_for_frames,
  waiting_for_arm,
  frames_late,
  poses_frozen,
  overruns,
  frames_stale,
  sender_restarted,
  soft_limit,
  time_gap,
  many_overruns,
  disarmed,
  shutdown,
  valves_silent,
  emergency_stop,
  deadman_released,
  pressure_mismatch,
  curvature_mismatch,
  command_expired,
  oscillation,
  length_mismatch,
  foreign_commands,
  requests_lost,
  frames_refused,  ///< frames_late or frames_stale, where frames come but are refused
  frame_period_mismatch,
  activated_too_often,
  wrong_model,
  contact,         ///< that HOLD answers
  contact_vented,  ///< that VENT answers
  law_late,        ///< the newest answer of an external law is no longer valid
  law_silent       ///< and has not been for a while
};
inline constexpr int kReasons = static_cast<int>(Reason::law_silent) + 1;

/// As above, in static storage; "unknown" for a value outside the enumeration.
const char* name(Mode mode) noexcept;
const char* name(Reason reason) noexcept;

/// What is required, once a cause is gone, before the arm may become active again. Always
/// `good_frames` good frames in a row, after VENT and FAULT counted from when the arm is fully
/// vented.
enum class Clearance : std::int8_t {
  good_frames,      ///< no more than that; after VENT an `arm` too, with explicit arming
  arm,              ///< an operator's `arm`, with automatic arming too
  disarm_then_arm,  ///< an operator's `disarm`, which leaves FAULT, and then an `arm`
  never             ///< the daemon ends
};

/// One row of the table of causes.
struct CauseRule {
  Reason reason;
  Mode demands;
  Clearance clearance;
};
/// Every cause; of those present the first one applies.
std::span<const CauseRule> cause_table() noexcept;

/// Times after which silence has consequences, resolved from settings and control period.
struct SafetyThresholds {
  std::int64_t hold_after_ns;  ///< frame age that freezes the pressures
  std::int64_t vent_after_ns;  ///< frame age, or gap between ticks, that vents
  std::int64_t valve_silence_ns;
  std::int64_t deadman_timeout_ns;
  std::int64_t law_vent_after_ns;  ///< since the newest answer of an external law has expired
  std::int64_t arm_lapses_ns;      ///< an `arm` that has not led to ACTIVE by then is taken back
};
/// Times given in the settings (s); where zero, derived from control and frame period T and T_f: HOLD
/// after max(3 T, 3 T_f + latency), VENT after max(0.1 s, 10 T_f, 3 T). An `arm` lapses after 2 s plus
/// the time of twice the good frames needed.
SafetyThresholds resolve_thresholds(const SafetySettings& settings,
                                    double control_period_s) noexcept;

/// Requests of an operator or of the program to the tick; several may be set at once.
struct OperatorRequests {
  bool arm = false;
  bool disarm = false;
  bool emergency_stop = false;
  bool shutdown = false;  ///< from now on: vent, and nothing else
  bool lost = false;      ///< some may have been lost: a disarm or an emergency stop too
};

/// Inputs of the monitor in one tick. Times are of one monotonic clock, in ns.
struct SafetyInput {
  std::int64_t now_ns = 0;
  std::int64_t newest_capture_ns = kNever;  ///< of the segment seen longest ago
  bool motion_unknown = false;              ///< u of some segment is not known at this tick
  int good_frames = 0;                 ///< accepted since the last tick with every segment seen
  int bad_frames = 0;                  ///< the others
  bool frames_refused = false;         ///< the newest frame that came was refused for what it is
  bool frame_period_mismatch = false;  ///< frames come much faster than declared
  bool activated_too_often = false;    ///< without an operator in between
  bool sender_restarted = false;
  bool poses_frozen = false;  ///< poses repeat bit for bit although the command has moved
  bool soft_limit_exceeded = false;
  bool fully_vented = false;                    ///< every commanded pressure is zero
  int consecutive_overruns = 0;                 ///< ticks missed in a row, up to this one
  std::int64_t newest_measurement_ns = kNever;  ///< of the valves' read-back
  bool pressure_mismatch = false;               ///< measured pressures do not follow the commands
  bool curvature_mismatch = false;              ///< the arm is not where its pressures would put it
  bool oscillation = false;            ///< the arm swings about its reference and does not stop
  bool length_mismatch = false;        ///< the arm is not as long as configured
  bool wrong_model = false;            ///< what was learnt of the arm is no correction of its model
  bool contact_holds = false;          ///< something pushes the arm, and HOLD is to answer that
  bool contact_vents = false;          ///< the same, and VENT
  bool paused = false;                 ///< the clock stood still since the last tick
  bool command_expired = false;        ///< the last command expired: the valves have vented
  bool deadman_used = false;           ///< there is a dead-man input
  std::int64_t newest_go_ns = kNever;  ///< arrival of the newest "go"
  std::int64_t newest_foreign_ns = kNever;  ///< of the newest command that another program sent
  bool law_used = false;                    ///< control is by an external law
  std::int64_t law_until_ns = kNever;       ///< end of validity of its newest answer
  OperatorRequests requests = {};
};

/// Reads no clock, allocates nothing, throws nothing. Transitions follow the severity of the causes
/// present: the most severe wins. The silence of the valves counts only while the monitor is
/// stepped: measurements that arrived while the daemon was stopped may have been dropped. After
/// such a stop, or where commands did not reach the valves in time, no frame is good before a new
/// measurement arrives, and for half a second neither frames nor an `arm` count: they may be older
/// than they look. While nothing is pressurised (WAIT_FRAMES) a cause that demands HOLD or VENT
/// only keeps the arm from becoming active; with explicit arming one that demands VENT takes the
/// arming back.
class SafetyMonitor {
 public:
  /// Starts in Mode::init; armed if the settings arm automatically.
  SafetyMonitor(const SafetySettings& settings, double control_period_s) noexcept;

  /// The mode of this tick. To be called once per tick, with times that never go back.
  Mode step(const SafetyInput& input) noexcept;

  /// Mode after the latest step.
  Mode mode() const noexcept { return mode_; }
  /// Reason of the mode; none in ACTIVE.
  Reason reason() const noexcept { return reason_; }
  /// Whether the arm may become active once nothing else prevents it.
  bool armed() const noexcept { return armed_; }
  /// The resolved thresholds.
  const SafetyThresholds& thresholds() const noexcept { return thresholds_; }

 private:
  friend struct ProofOfMonitor;  ///< tests/proof: ages beyond their thresholds

  void note_stop(const SafetyInput& input) noexcept;
  CauseRule worst_cause(const SafetyInput& input) const noexcept;
  bool under_control() const noexcept { return mode_ == Mode::active || mode_ == Mode::hold; }
  void take_operator_requests(const SafetyInput& input, Mode demanded) noexcept;
  void enter(const CauseRule& cause) noexcept;
  void try_to_activate(const SafetyInput& input, Reason otherwise) noexcept;

  SafetySettings settings_;
  SafetyThresholds thresholds_;
  Mode mode_ = Mode::init;
  Reason reason_ = Reason::starting;
  bool armed_;
  std::int64_t arm_pending_since_ns_ = kNever;  ///< of an `arm` that has not led to ACTIVE yet
  int good_in_a_row_ = 0;
  std::int64_t previous_tick_ns_ = 0;
  std::int64_t listening_since_ns_ = kNever;  ///< end of the last stop, for the valves
  std::int64_t deaf_until_ns_ = kNever;       ///< to `arm` and frames, after a stop
};

}  // namespace softarm
