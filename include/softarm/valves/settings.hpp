// What an experiment configures of the valves: what drives them, where the terminal is, its
// registers, what counts as a fault.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace softarm {

/// Terminals whose registers are known from documents; none of them was tried on hardware.
enum class TerminalKind { cpx_vppm, cpx_vtem, cpx_e, cpx_ap, free };
inline constexpr std::array<const char*, 5> kTerminalNames = {"cpx_vppm", "cpx_vtem", "cpx_e",
                                                              "cpx_ap", "free"};

/// Where a terminal keeps what. Addresses are those of the protocol (what libmodbus takes), from 0.
/// Valves stand in slots, `valves_per_slot` in each, their words side by side; -1 means "none".
struct RegisterMap {
  int write_address = 0;    ///< first word of the first slot
  int write_words = 1;      ///< a slot
  int set_point_word = 0;   ///< in the slot, of its first valve
  int valves_per_slot = 1;  ///< how many set points stand side by side
  int control_word = -1;    ///< in the slot
  int control_value = 0;    ///< written there in every cycle: regulate pressure
  int read_address = 0;     ///< first word of the first slot
  int read_words = 1;       ///< a slot
  int actual_word = 0;      ///< in the slot, measured pressure of its first valve
  int echo_word = -1;       ///< the set points as the terminal has them
  int diagnosis_word = -1;
  int diagnosis_mask = 0xffff;  ///< bits of the diagnosis that vent
  int status_word = -1;
  int status_mask = 0xff;
  int status_ready = 0;         ///< (status & mask) of a slot that regulates
  double units_per_bar = 1000;  ///< set points and measured pressures count mbar
  int timeout_address = -1;     ///< the terminal's own fail-safe time-out
  int timeout_words = 1;        ///< 2: low word first
  double timeout_unit_s = 1e-3;
  double timeout_least_s = 0.0;  ///< the terminal takes no less
};

/// Settings of softarm-valves.
struct ValveDriverSettings {
  std::string backend = "modbus";  ///< what drives the valves: a name of valve_backend_names()
  std::string device;              ///< what a back end that is not on a network opens
  std::string host = "127.0.0.1";  ///< IPv4 address
  int port = 502;
  int unit_id = 1;
  TerminalKind terminal = TerminalKind::cpx_vppm;
  RegisterMap registers;
  std::vector<int> order;             ///< the valve of every chamber, counted from 0
  double rate_hz = 200.0;             ///< cycles: one block write, one block read
  double response_timeout_s = 0.004;  ///< of one request, below one period
  double connect_timeout_s = 0.25;
  int tolerated_failures = 2;  ///< cycles in a row without an answer before the link is given up
  double backoff_s = 0.1;      ///< before the first attempt to connect again; doubles
  double longest_backoff_s = 5.0;
  double failsafe_timeout_s = 0.2;  ///< set in the terminal, which vents when we fall silent
  double stuck_bar = 0.3;           ///< a pressure further from its set point than this ...
  double stuck_after_s = 1.0;       ///< ... for so long belongs to a stuck valve
  bool stuck_vents = true;          ///< false: only reported
};

}  // namespace softarm
