// Keys of the valve terminal: read, refused, printed and read again.
#include <gtest/gtest.h>

#include "softarm/config/config_error.hpp"
#include "softarm/config/load.hpp"
#include "softarm/valves/register_map.hpp"
#include "unit/config/config_files.hpp"

namespace softarm {
namespace {

constexpr const char* kArmWithValves = R"(name: valves
arm: {segments: 2, length_m: 0.25, mass_kg: 0.25, stiffness_nm_per_rad: 2, damping_nms_per_rad: 0.5}
actuation: {chambers: {angle_rad: [0, 2, 4], gain_nm_per_bar: 1}}
control: {kp_nm_per_rad: 1}
reference:
  - {kind: set_point, theta_rad: 0.2}
)";

class ValvesKeys : public ::testing::Test {
 protected:
  Experiment load(const std::string& valves) {
    return load_experiment(folder.write("a.yaml", kArmWithValves + valves));
  }
  void refuses(const std::string& valves, const std::string& evidence) {
    try {
      load("valves: " + valves + "\n");
      ADD_FAILURE() << valves << " was accepted";
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find(evidence), std::string::npos) << error.what();
      EXPECT_EQ(error.line, 7) << error.what();
    }
  }
  TestFolder folder;
};

TEST_F(ValvesKeys, ChoosingATerminalChoosesItsRegisters) {
  const Experiment first = load(
      "valves: {host: 10.0.0.7, terminal: cpx_ap, order: [5, 4, 3, 2, 1, 0], failsafe_timeout_s: "
      "0.5, registers: {read_address: 6000, echo_word: 1, read_words: 2}}\n");
  const RegisterMap& map = first.valves.registers;
  EXPECT_EQ(map.timeout_address, 14000);
  EXPECT_EQ(map.write_address, 0);
  EXPECT_EQ(map.read_address, 6000);
  EXPECT_EQ(map.echo_word, 1);
  EXPECT_EQ(map.diagnosis_word, -1);
  EXPECT_EQ(first.valves.order, (std::vector<int>{5, 4, 3, 2, 1, 0}));
  const Experiment again = load_experiment(folder.write("b.yaml", resolved_text(first)));
  EXPECT_EQ(resolved_text(again), resolved_text(first));
  EXPECT_EQ(again.hash, first.hash);
}

// Another program may have back ends that this one does not know.
TEST_F(ValvesKeys, AnotherBackEndNeedsNoRegisters) {
  const Experiment board = load(
      "valves: {backend: serial_board, device: /dev/ttyACM0, failsafe_timeout_s: 0.05, terminal: "
      "free, host: not.used}\n");
  EXPECT_EQ(board.valves.backend, "serial_board");
  EXPECT_EQ(board.valves.device, "/dev/ttyACM0");
  EXPECT_EQ(load("").valves.backend, "modbus");
}

TEST_F(ValvesKeys, LeftOutTheyHaveTheirDefaults) {
  const Experiment plain = load("");
  EXPECT_EQ(plain.valves.order, (std::vector<int>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(plain.valves.registers.write_address,
            register_preset(TerminalKind::cpx_vppm).write_address);
}

TEST_F(ValvesKeys, AnArmThatNoTerminalHoldsNeedsNone) {
  std::string many = kArmWithValves;
  many.replace(many.find("segments: 2"), 11, "segments: 120");
  const Experiment big = load_experiment(folder.write("big.yaml", many));
  EXPECT_EQ(big.valves.order.size(), 360u);
}

TEST_F(ValvesKeys, WhatCannotBeMeantIsRefused) {
  refuses("{host: terminal}", "valves.host");
  refuses("{backend: ''}", "valves.backend");
  refuses("{backend: serial_board, failsafe_timeout_s: 0.01}", "at least 0.015 s");
  refuses("{host: 300.0.0.1}", "an IPv4 address");
  refuses("{port: 0}", "[1, 65535]");
  refuses("{terminal: festo}", "one of cpx_vppm, cpx_vtem, cpx_e, cpx_ap, free");
  refuses("{order: [0, 1, 2, 3, 4]}", "a list of 6 whole numbers");
  refuses("{order: [0, 1, 2, 3, 4, 4]}", "valve 4 twice");
  refuses("{order: [-1, 1, 2, 3, 4, 5]}", "valves.order");
  refuses("{rate_hz: 500}", "less than one period of valves.rate_hz (0.002 s)");
  refuses("{failsafe_timeout_s: 0.05}", "at least 0.1 s");
  refuses("{failsafe_timeout_s: 0}", "valves.failsafe_timeout_s");
  refuses("{rate_hz: 10, failsafe_timeout_s: 0.25}", "at least 0.3 s");
  refuses("{backoff_s: 10}", "at least backoff_s (10 s)");
  refuses("{terminal: free}", "no timeout_address");
  refuses("{registers: {timeout_address: none}}", "no timeout_address");
  refuses("{registers: {write_words: 0}}", "valves.registers.write_words");
  refuses("{registers: {units_per_bar: 20000}}", "does not fit a word");
  refuses("{registers: {read_address: 40004}}", "blocks that overlap at 40004");
  refuses("{registers: {reed_address: 1}}", "did you mean read_address");
  refuses("{registers: {timeout_unit_s: 1e-6}}", "a time-out that fits its register");
}

}  // namespace
}  // namespace softarm
