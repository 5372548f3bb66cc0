// Settings of the valves: the back end, the address of the terminal, its registers, and what counts
// as a fault. config/template.yaml documents every setting.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace softarm {

/// Terminals whose registers are known from their manuals; none of them was tested on hardware.
enum class TerminalKind { cpx_vppm, cpx_vtem, cpx_e, cpx_ap, free };
inline constexpr std::array<const char*, 5> kTerminalNames = {"cpx_vppm", "cpx_vtem", "cpx_e",
                                                              "cpx_ap", "free"};

/// Register layout of a terminal. Addresses are those of the protocol (as libmodbus takes them),
/// from 0. Valves are grouped in slots, `valves_per_slot` in each, their words adjacent; -1 means
/// "none".
struct RegisterMap {
  int write_address = 0;
  int write_words = 1;
  int set_point_word = 0;
  int valves_per_slot = 1;
  int control_word = -1;
  int control_value = 0;
  int read_address = 0;
  int read_words = 1;
  int actual_word = 0;
  int echo_word = -1;
  int diagnosis_word = -1;
  int diagnosis_mask = 0xffff;
  int status_word = -1;
  int status_mask = 0xff;
  int status_ready = 0;  ///< (status & mask) of a slot that regulates
  double units_per_bar = 1000;
  int timeout_address = -1;
  int timeout_words = 1;
  double timeout_unit_s = 1e-3;
  double timeout_least_s = 0.0;
};

/// Settings of softarm-valves.
struct ValveDriverSettings {
  std::string backend = "modbus";  ///< one of valve_backend_names()
  std::string device;              ///< opened by a back end that is not on a network
  std::string host = "127.0.0.1";
  int port = 502;
  int unit_id = 1;
  TerminalKind terminal = TerminalKind::cpx_vppm;
  RegisterMap registers;
  std::vector<int> order;  ///< the valve of every chamber, counted from 0
  double rate_hz = 200.0;
  double response_timeout_s = 0.004;
  double connect_timeout_s = 0.25;
  int tolerated_failures = 2;
  double backoff_s = 0.1;
  double longest_backoff_s = 5.0;
  double failsafe_timeout_s = 0.2;
  double vented_bar = 0.1;
  double stuck_bar = 0.3;
  double stuck_after_s = 1.0;
  bool stuck_vents = true;
};

}  // namespace softarm
