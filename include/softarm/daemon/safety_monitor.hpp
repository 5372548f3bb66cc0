// The safety monitor: a pure state machine that decides, tick by tick, whether the arm may be
// moved.
#pragma once

#include <cstdint>
#include <limits>

#include "softarm/daemon/settings.hpp"

namespace softarm {

/// What the daemon does with the valves. The order is the order of severity from `active` on.
enum class Mode : std::int8_t {
  init,         ///< before the first tick
  wait_frames,  ///< vented, until good frames come and the arm is armed
  active,       ///< under control
  hold,         ///< pressures frozen
  vent,         ///< pressures ramp to zero and stay there
  fault         ///< like `vent`, and latched until an operator disarms
};

/// Why the mode is what it is; the table of causes in safety_monitor.cpp says what each demands and
/// what clears it.
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
  valves_silent
};

/// As above, in static storage; "unknown" for a value outside the enumeration.
const char* name(Mode mode) noexcept;
const char* name(Reason reason) noexcept;

/// Times after which silence has consequences, resolved from settings and control period.
struct SafetyThresholds {
  std::int64_t hold_after_ns;  ///< frame age that freezes the pressures
  std::int64_t vent_after_ns;  ///< frame age, or gap between ticks, that vents
  std::int64_t valve_silence_ns = 100'000'000;
};
SafetyThresholds resolve_thresholds(const SafetySettings& settings,
                                    double control_period_s) noexcept;

/// What the monitor is told in one tick. Times are of one monotonic clock, in ns.
struct SafetyInput {
  std::int64_t now_ns = 0;
  std::int64_t newest_capture_ns =
      std::numeric_limits<std::int64_t>::min();  ///< of the segment seen longest ago
  bool motion_unknown = false;                   ///< u of some segment is not known at this tick
  int good_frames = 0;  ///< accepted since the last tick with every segment seen
  int bad_frames = 0;   ///< the others
  bool sender_restarted = false;
  bool poses_frozen = false;  ///< poses repeat bit for bit although the command has moved
  bool soft_limit_exceeded = false;
  bool fully_vented = false;  ///< every commanded pressure is zero
  int consecutive_overruns = 0;
  std::int64_t newest_measurement_ns =
      std::numeric_limits<std::int64_t>::min();  ///< of the valves' read-back
  bool arm = false;
  bool disarm = false;
  bool shutdown = false;
};

/// Reads no clock, allocates nothing, throws nothing. Transitions follow the severity of the causes
/// present: the most severe wins; HOLD and VENT are left for ACTIVE only by `good_frames` good
/// frames in a row, after VENT counted from when the arm is fully vented. With explicit arming a
/// VENT must be armed anew; with automatic arming only one for a soft limit, and a fault.
class SafetyMonitor {
 public:
  SafetyMonitor(const SafetySettings& settings, double control_period_s) noexcept;

  Mode step(const SafetyInput& input) noexcept;

  Mode mode() const noexcept { return mode_; }
  Reason reason() const noexcept { return reason_; }
  bool armed() const noexcept { return armed_; }
  const SafetyThresholds& thresholds() const noexcept { return thresholds_; }

 private:
  struct Verdict {
    Mode demands;
    Reason reason;
  };
  Verdict worst_cause(const SafetyInput& input) const noexcept;
  void take_operator_requests(const SafetyInput& input, Mode demanded) noexcept;
  void enter(Mode mode, Reason reason) noexcept;
  void try_to_activate(const SafetyInput& input, Reason otherwise) noexcept;

  SafetySettings settings_;
  SafetyThresholds thresholds_;
  Mode mode_ = Mode::init;
  Reason reason_ = Reason::starting;
  bool armed_;
  int good_in_a_row_ = 0;
  std::int64_t previous_tick_ns_ = 0;
};

}  // namespace softarm
