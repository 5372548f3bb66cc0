#include "dev/soak/soak_faults.hpp"

#include <array>

namespace softarm {
namespace {

constexpr SoakFault frames_away(const char* name, const char* relay_fault, double amount = 0.0) {
  return {name, SoakAction::relay, relay_fault, amount, Mode::vent, Reason::frames_stale};
}
constexpr SoakFault frames_refused(const char* name) {
  return {name, SoakAction::relay, name, 0.0, Mode::vent, Reason::frames_refused};
}
constexpr SoakFault leads_to(Mode mode, Reason reason, const char* name, SoakAction action) {
  return {name, action, "", 0.0, mode, reason};
}
constexpr SoakFault harmless(const char* name, const char* relay_fault,
                             std::int64_t ArmStatus::*counter, int counts, double amount = 0.0) {
  return {name,         SoakAction::relay, relay_fault, amount,
          Mode::active, Reason::none,      counter,     counts};
}

constexpr SoakFault of_valves(const char* name, SoakAction action,
                              ValveReason valves = ValveReason::none) {
  return {name, action, "", 0.0, Mode::vent, Reason::none, nullptr, 0, valves};
}

constexpr std::array kFaults{
    frames_away("stop", "stop"),
    frames_away("occlude", "occlude"),
    frames_away("stale body", "stale"),
    frames_refused("nan"),
    frames_refused("inf"),
    frames_refused("quaternion"),
    frames_refused("length"),
    frames_refused("turn"),
    frames_refused("swap"),
    frames_away("delay 0.3 s", "delay", 0.3),
    harmless("delay 0.03 s", "delay", &ArmStatus::frames_accepted, 100, 0.03),
    harmless("clock + 1 h", "clock", &ArmStatus::frames_accepted, 100),
    harmless("duplicate", "duplicate", &ArmStatus::frames_repeated, 50),
    harmless("reorder", "reorder", &ArmStatus::frames_rejected, 50),
    harmless("jump", "jump", &ArmStatus::frames_rejected, 10),
    SoakFault{"restart", SoakAction::relay, "restart", 0.0, Mode::vent, Reason::sender_restarted},
    SoakFault{"freeze", SoakAction::relay, "freeze", 0.0, Mode::hold, Reason::poses_frozen},
    SoakFault{"valves silent", SoakAction::relay, "silence", 0.0, Mode::fault,
              Reason::valves_silent},
    SoakFault{"burst", SoakAction::relay, "burst", 0.0, Mode::fault, Reason::pressure_mismatch},
    leads_to(Mode::vent, Reason::disarmed, "disarm", SoakAction::disarm),
    leads_to(Mode::fault, Reason::emergency_stop, "emergency stop", SoakAction::emergency_stop),
    leads_to(Mode::vent, Reason::deadman_released, "dead man lets go", SoakAction::let_go),
    leads_to(Mode::vent, Reason::deadman_released, "dead man silent", SoakAction::fall_silent),
    SoakFault{"hostile bytes", SoakAction::hostile, "", 0.0, Mode::active, Reason::none,
              &ArmStatus::messages_malformed, 100},
    SoakFault{"flood", SoakAction::flood, "", 0.0, Mode::active, Reason::none,
              &ArmStatus::messages_malformed, 100},
    leads_to(Mode::vent, Reason::time_gap, "daemon stopped", SoakAction::pause_daemon),
    leads_to(Mode::vent, Reason::frames_stale, "plant stopped", SoakAction::pause_plant),
    leads_to(Mode::fault, Reason::emergency_stop, "stop while paused",
             SoakAction::stop_while_paused),
    leads_to(Mode::fault, Reason::emergency_stop, "stop in a flood", SoakAction::stop_in_flood),
    leads_to(Mode::vent, Reason::foreign_commands, "second commander",
             SoakAction::second_commander),
    leads_to(Mode::vent, Reason::command_expired, "commands lost", SoakAction::lose_commands),
    leads_to(Mode::vent, Reason::time_gap, "suspended", SoakAction::suspend),
    of_valves("terminal refuses", SoakAction::refuse_writes, ValveReason::zero_unconfirmed),
    of_valves("terminal ignores", SoakAction::ignore_writes, ValveReason::zero_unconfirmed),
    of_valves("valves stuck", SoakAction::stick_valves, ValveReason::stuck_valve),
    of_valves("time-out lost", SoakAction::lose_timeout, ValveReason::failsafe_changed),
    of_valves("driver stopped", SoakAction::pause_valves),
    of_valves("driver suspended", SoakAction::suspend_valves, ValveReason::time_gap),
    of_valves("driver killed", SoakAction::kill_valves),
    leads_to(Mode::vent, Reason::frames_stale, "plant replaced", SoakAction::restart_plant),
    SoakFault{"daemon ended", SoakAction::end_daemon},
    SoakFault{"daemon killed", SoakAction::kill_daemon},
    leads_to(Mode::fault, Reason::emergency_stop, "killed in FAULT", SoakAction::kill_stopped),
};

}  // namespace

std::span<const SoakFault> soak_faults() { return kFaults; }

}  // namespace softarm
