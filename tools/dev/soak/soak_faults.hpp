// The faults that a soak causes, and what each demands of the daemon.
#pragma once

#include <cstdint>
#include <span>

#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/transport/arm_messages.hpp"
#include "softarm/valves/valve_guard.hpp"

namespace softarm {

/// What makes it.
enum class SoakAction {
  relay,   ///< the fault injector between sensors and daemon, by `SoakFault::relay_fault`
  disarm,  ///< an operator
  emergency_stop,
  let_go,        ///< the dead-man input is withdrawn
  fall_silent,   ///< the dead-man input is not sent
  hostile,       ///< bytes that are no message
  flood,         ///< the same, as fast as they can be sent
  pause_daemon,  ///< SIGSTOP, for longer than vent_after_s
  pause_plant,
  stop_while_paused,  ///< an emergency stop that the daemon hears when it goes on
  stop_in_flood,      ///< one among requests that are none
  second_commander,   ///< one command of somebody else, for full pressure
  lose_commands,      ///< between daemon and valves, for longer than they are valid
  suspend,            ///< the daemon's CLOCK_MONOTONIC stands still
  refuse_writes,      ///< the terminal, with exception replies
  ignore_writes,      ///< the terminal acknowledges them and does nothing
  stick_valves,       ///< they stay where they are
  lose_timeout,       ///< another master takes the terminal's time-out away
  pause_valves,       ///< the valve driver, by SIGSTOP, for longer than the terminal's time-out
  suspend_valves,     ///< the driver's CLOCK_MONOTONIC stands still
  restart_plant,      ///< SIGKILL, and another one
  kill_valves,        ///< the driver, the same
  end_daemon,         ///< SIGTERM, and another one
  kill_daemon,        ///< SIGKILL, and another one
  kill_stopped        ///< the same after an emergency stop, which the other one has to know of
};

/// Demanded is a mode with its reason, or, where nothing may happen to the arm, that a counter of
/// the status goes on; of a daemon that ends, that the arm is vented; of the valve side, that the
/// daemon leaves ACTIVE and no pressure is left behind the valves, unless they stick.
struct SoakFault {
  const char* name;
  SoakAction action;
  const char* relay_fault = "";
  double amount = 0.0;  ///< of the relay's fault; 0: as usual
  Mode mode = Mode::active;
  Reason reason = Reason::none;
  std::int64_t ArmStatus::*counter = nullptr;
  int counts = 0;                          ///< how far the counter must go on
  ValveReason valves = ValveReason::none;  ///< that the valve driver must report

  bool of_valves() const {
    return (action >= SoakAction::refuse_writes && action <= SoakAction::suspend_valves) ||
           action == SoakAction::kill_valves;
  }
  /// A process is replaced, so that nothing can be said of its memory over the whole run.
  bool replaces_process() const { return action >= SoakAction::restart_plant; }
};
std::span<const SoakFault> soak_faults();

}  // namespace softarm
