// softarm-valves between LCM and Modbus TCP, whole programs on both sides: the simulated arm's
// server through a relay that does harm, and pymodbus, which is not ours.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <regex>

#include "dev/clock/preloaded_clocks.hpp"
#include "integration/valves/relay.hpp"
#include "integration/valves/valves_program.hpp"

namespace softarm {
namespace {

using test::kChambers;
using test::Process;
using test::Relay;
using test::ValvesProgram;

/// The simulated arm, the relay, the driver.
class ValvesBehindARelay : public ValvesProgram {
 protected:
  void begin(const std::string& valves = "", const std::string& safety = "") {
    configure(1, valves, safety);
    plant_process_ = start_terminal();
    relay_ = std::make_unique<Relay>(plant_process_->port());
    configure(relay_->port(), valves, safety);
    driver_ = start("softarm-valves");
  }
  void TearDown() override {
    if (relay_) {
      EXPECT_EQ(relay_->negative_set_points, 0);
    }
  }
  bool run_at(double bar) {
    return command_until(
        bar, [&] { return is(ValveState::running, ValveReason::none) && pressure_is(bar); });
  }
  /// Runs at 0.3 bar with `fault` switched on until `wanted`. A busy machine may lose the
  /// connection first: then all begins again.
  bool provoke(const std::function<void(bool)>& fault, ValveReason wanted) {
    for (int attempt = 0; attempt < 20; ++attempt) {
      if (!run_at(0.3)) return false;
      fault(true);
      command_until(0.3, [&] {
        return is(ValveState::degraded, wanted) || valves().state == ValveState::disconnected;
      });
      if (is(ValveState::degraded, wanted)) return true;
      fault(false);
    }
    return false;
  }
  /// It came back by itself and the arm is under pressure again.
  void expect_recovery() { EXPECT_TRUE(run_at(0.3)) << driver_->printed(); }

  std::unique_ptr<Process> plant_process_;
  std::unique_ptr<Relay> relay_;
  std::unique_ptr<Process> driver_;  // ends first
};

TEST_F(ValvesBehindARelay, CommandsReachTheArmExpireAndAStopVents) {
  begin();
  ASSERT_TRUE(run_at(0.4)) << driver_->printed() << plant_process_->printed();
  EXPECT_GE(measured_.sequence, 0);
  EXPECT_FALSE(plant_.vented);
  // Nothing is sent any more.
  ASSERT_TRUE(wait_for([&] {
    return is(ValveState::vented, ValveReason::no_command) && pressure_is(0.0);
  })) << driver_->printed();
  EXPECT_EQ(measured_.sequence, -1);
  ASSERT_TRUE(run_at(0.4));
  EXPECT_EQ(end(*driver_), 0) << driver_->printed();
  EXPECT_TRUE(command_until(0.4, [&] { return plant_.vented; })) << "its time-out, later";
  EXPECT_LT(plant_.pressure_bar[0], 0.02);
}

TEST_F(ValvesBehindARelay, ShadowForeignAndHostileCommandsMoveNothing) {
  begin();
  ASSERT_TRUE(wait_for([&] { return valves().state == ValveState::vented; })) << driver_->printed();
  const auto publish_for_a_while = [&] {
    const int before = measurements_;
    EXPECT_TRUE(wait_for([&] {
      publish();
      return measurements_ > before + 10;
    }));
  };
  sent_.pressure_bar.assign(kChambers, 1.0F);
  sent_.shadow = 1;
  publish_for_a_while();
  sent_.shadow = 0;
  sent_.pressure_bar[3] = std::nanf("");
  publish_for_a_while();
  sent_.pressure_bar.assign(kChambers + 1, 1.0F);
  sent_.num_chambers = kChambers + 1;
  publish_for_a_while();
  sent_.pressure_bar.assign(kChambers, -1.0F);
  sent_.num_chambers = kChambers;
  publish_for_a_while();
  EXPECT_TRUE(pressure_is(0.0));
  EXPECT_GT(valves().commands_refused, 0);
  sent_.validity_us = 300'000;
  EXPECT_TRUE(run_at(0.2)) << "and it still takes good ones" << driver_->printed();
}

TEST_F(ValvesBehindARelay, LateAnswersVentAndAreSurvived) {
  begin();
  ASSERT_TRUE(run_at(0.3)) << driver_->printed();
  relay_->delay_us = 80'000;
  ASSERT_TRUE(command_until(0.3, [&] {
    return is(ValveState::disconnected, ValveReason::no_answer);
  })) << driver_->printed();
  EXPECT_GT(valves().no_answers, 2);
  EXPECT_TRUE(command_until(0.3, [&] { return plant_.pressure_bar[0] < 0.02; }))
      << "by zero or time-out";
  relay_->delay_us = 0;
  expect_recovery();
}

TEST_F(ValvesBehindARelay, ExceptionRepliesVentAndAreSurvived) {
  begin();
  ASSERT_TRUE(provoke([&](bool on) { relay_->exceptions = on; }, ValveReason::exception_reply))
      << driver_->printed();
  ASSERT_TRUE(command_until(0.3, [&] { return plant_.pressure_bar[0] < 0.02; }));
  EXPECT_GT(valves().exceptions, 2);
  relay_->exceptions = false;
  expect_recovery();
}

TEST_F(ValvesBehindARelay, ADisconnectInTheMiddleOfAWriteVentsAndIsSurvived) {
  begin();
  for (int round = 0; round < 3; ++round) {
    ASSERT_TRUE(run_at(0.3)) << driver_->printed();
    const std::int64_t before = valves().connections_lost;
    relay_->refuse = round == 2;
    relay_->cut_next_write = true;
    ASSERT_TRUE(command_until(0.3, [&] { return valves().connections_lost > before; }))
        << driver_->printed();
    EXPECT_TRUE(command_until(0.3, [&] { return plant_.pressure_bar[0] < 0.02; }));
    relay_->refuse = false;
  }
  expect_recovery();
  EXPECT_GT(relay_->connections, 3);
}

TEST_F(ValvesBehindARelay, AStuckValveIsReportedAndVents) {
  begin(", stuck_after_s: 0.3");
  ASSERT_TRUE(run_at(0.3)) << driver_->printed();
  relay_->stuck_at = 900;
  relay_->stuck_word = 3 * 5;  // measured pressure of the sixth valve
  ASSERT_TRUE(command_until(0.3, [&] {
    return is(ValveState::degraded, ValveReason::stuck_valve);
  })) << driver_->printed();
  EXPECT_EQ(valves().chamber, 5);
  EXPECT_TRUE(command_until(0.3, [&] { return plant_.pressure_bar[0] < 0.02; }));
  EXPECT_TRUE(wait_for(
      [&] { return driver_->printed().find("stuck valve): chamber 5") != std::string::npos; }));
  relay_->stuck_word = -1;
  ASSERT_TRUE(
      command_until(0.3, [&] { return is(ValveState::vented, ValveReason::waiting_for_zero); }));
  ASSERT_TRUE(command_until(0.0, [&] { return valves().state == ValveState::running; }));
  expect_recovery();
}

TEST_F(ValvesBehindARelay, ATerminalThatRestartsIsSecuredAgain) {
  begin();
  ASSERT_TRUE(run_at(0.3)) << driver_->printed();
  ASSERT_EQ(end(*plant_process_, SIGKILL), 128 + SIGKILL);
  ASSERT_TRUE(command_until(0.3, [&] { return valves().state == ValveState::disconnected; }))
      << driver_->printed();
  plant_process_ = start_terminal();
  relay_->server_port_ = plant_process_->port();
  expect_recovery();
  // Had its time-out not been set once more, this arm would keep its pressure.
  driver_->signal(SIGKILL);
  EXPECT_TRUE(command_until(0.3, [&] { return plant_.vented && plant_.pressure_bar[0] < 0.02; }));
}

TEST_F(ValvesBehindARelay, AStoppedAndContinuedDriverVents) {
  begin();
  ASSERT_TRUE(run_at(0.3)) << driver_->printed();
  driver_->signal(SIGSTOP);
  ASSERT_TRUE(command_until(0.3, [&] { return plant_.vented; })) << "the terminal's own time-out";
  driver_->signal(SIGCONT);
  // A busy machine may stop it for so short a time that the terminal's set points alone show it.
  EXPECT_TRUE(command_until(0.3, [&] {
    return is(ValveState::degraded, ValveReason::time_gap) ||
           is(ValveState::degraded, ValveReason::echo_mismatch);
  })) << driver_->printed();
  expect_recovery();
}

#ifndef SOFTARM_SANITIZED  // a sanitizer's runtime must be loaded first
/// The same driver on clocks that the test sets.
class ValvesOnPausedMachines : public ValvesBehindARelay {
 protected:
  void begin_on_set_clocks() {
    clocks_ = std::make_unique<PreloadedClocks>((folder_ / "clocks").string());
    ASSERT_TRUE(clocks_->made());
    begin();
    driver_.reset();
    std::vector<std::string> arguments = clocks_->preload();
    arguments.push_back(std::string(SOFTARM_BINARY_DIR) + "/bin/softarm-valves");
    driver_ = start("/env", arguments);
    ASSERT_TRUE(run_at(0.3)) << driver_->printed();
  }
  std::unique_ptr<PreloadedClocks> clocks_;
};

TEST_F(ValvesOnPausedMachines, ASuspendVents) {
  begin_on_set_clocks();
  clocks_->suspend(5 * test::kSecond);
  EXPECT_TRUE(command_until(0.3, [&] { return is(ValveState::degraded, ValveReason::time_gap); }))
      << driver_->printed();
  EXPECT_TRUE(command_until(0.3, [&] { return plant_.pressure_bar[0] < 0.02; }));
  expect_recovery();
}

// The terminal has vented by itself meanwhile. What it holds is read before it is written again.
TEST_F(ValvesOnPausedMachines, APauseThatNoClockCountsVentsToo) {
  begin_on_set_clocks();
  const std::int64_t stopped_ns = monotonic_now_ns();
  driver_->stop();
  ASSERT_TRUE(command_until(0.3, [&] { return plant_.vented && plant_.pressure_bar[0] < 0.02; }));
  clocks_->lose(monotonic_now_ns() - stopped_ns);
  double highest_bar = 0.0;
  const int before = valve_statuses_;
  driver_->signal(SIGCONT);
  EXPECT_TRUE(command_until(0.3, [&] {
    highest_bar = std::max(highest_bar, plant_.pressure_bar[0]);
    return valve_statuses_ > before && is(ValveState::degraded, ValveReason::echo_mismatch);
  })) << driver_->printed();
  EXPECT_LT(highest_bar, 0.05) << "it is not filled again";
  expect_recovery();
}
#endif

TEST_F(ValvesBehindARelay, WithExplicitArmingCommandsOfZeroComeFirst) {
  begin("", ", arming: explicit");
  ASSERT_TRUE(wait_for([&] { return is(ValveState::vented, ValveReason::no_command); }))
      << driver_->printed();
  go_on(0.3);  // longer than command_validity_s: that is silence
  ASSERT_TRUE(run_at(0.3)) << driver_->printed();
  relay_->cut_next_write = true;
  ASSERT_TRUE(command_until(0.3, [&] {
    return is(ValveState::vented, ValveReason::waiting_for_zero);
  })) << driver_->printed();
  const int statuses = valve_statuses_;
  bool ran = false;
  EXPECT_TRUE(command_until(0.3, [&] {
    ran |= valves().state == ValveState::running;
    return valve_statuses_ > statuses + 5;
  }));
  EXPECT_FALSE(ran) << "zero was not commanded";
  ASSERT_TRUE(command_until(0.0, [&] { return valves().state == ValveState::running; }));
  expect_recovery();
}

// Whoever commands the valves: no daemon runs here.
TEST_F(ValvesBehindARelay, AnEmergencyStopVentsWithoutADaemonUntilItIsAcknowledged) {
  begin();
  ASSERT_TRUE(run_at(0.3)) << driver_->printed();
  const auto request = [&](std::int8_t kind) {
    node_->publish("SOFTARM_OPERATOR", softarm_messages::operator_command_t{
                                           .sequence = 1, .nonce = 0, .request = kind});
  };
  using Request = softarm_messages::operator_command_t;
  ASSERT_TRUE(command_until(0.3, [&] {
    request(Request::EMERGENCY_STOP);
    return is(ValveState::degraded, ValveReason::emergency_stop) && pressure_is(0.0);
  })) << driver_->printed();
  const int before = measurements_;
  bool pressurised = false;
  EXPECT_TRUE(command_until(0.3, [&] {
    pressurised |= !pressure_is(0.0);
    return measurements_ > before + 20;
  }));
  EXPECT_FALSE(pressurised);
  EXPECT_NE(driver_->printed().find("DEGRADED (emergency stop)"), std::string::npos);
  EXPECT_TRUE(command_until(0.0, [&] {
    request(Request::DISARM);
    return is(ValveState::running, ValveReason::none);
  })) << driver_->printed();
  expect_recovery();
}

// It is vented, but by name, and the one who stays is obeyed.
TEST_F(ValvesBehindARelay, AFloodOfCommandsFromTheBeginningIsNamed) {
  configure(1);
  plant_process_ = start_terminal();
  configure(plant_process_->port());
  softarm_messages::pressure_command_t theirs = sent_;
  theirs.pressure_bar.assign(kChambers, 2.0F);
  driver_ = start("softarm-valves");
  bool pressurised = false;
  EXPECT_TRUE(command_until(0.3, [&] {
    for (int k = 0; k < 50; ++k) {
      theirs.sequence = sent_.sequence + 1'000'000 + k;
      node_->publish("SOFTARM_PRESSURE_COMMAND", theirs);
    }
    pressurised |= largest(plant_.pressure_bar) > 0.0;
    return is(ValveState::degraded, ValveReason::other_sender);
  })) << driver_->printed();
  EXPECT_FALSE(pressurised);
  EXPECT_TRUE(command_until(0.0, [&] { return is(ValveState::running, ValveReason::none); }))
      << driver_->printed();
  expect_recovery();
}

TEST_F(ValvesBehindARelay, ASecondDriverIsKeptOut) {
  begin();
  ASSERT_TRUE(wait_for([&] { return valves().state == ValveState::vented; })) << driver_->printed();
  const auto same = start("softarm-valves");
  EXPECT_EQ(end_of(*same), 75) << same->printed();
  const auto plant_of_lcm = start("softarm-plant");  // it would publish the same pressures
  EXPECT_EQ(end_of(*plant_of_lcm), 75) << plant_of_lcm->printed();
  // Another arm by its channels, but the same terminal.
  const std::string text = file_text(config_);
  std::ofstream(config_) << std::regex_replace(
      text, std::regex("lcm: \\{"), "lcm: {command_channel: OTHER, measurement_channel: OTHER_P, ");
  const auto other = start("softarm-valves");
  EXPECT_EQ(end_of(*other), 75) << other->printed();
  EXPECT_NE(other->printed().find("terminal 127.0.0.1"), std::string::npos) << other->printed();
}

TEST_F(ValvesProgram, AStopWithoutATerminalIsNoError) {
  int free_port = 0;
  { free_port = Relay(1).port(); }
  configure(free_port);
  const auto driver = start("softarm-valves");
  ASSERT_TRUE(command_until(0.3, [&] { return valve_statuses_ > 3; })) << driver->printed();
  EXPECT_EQ(valves().state, ValveState::disconnected);
  EXPECT_EQ(measurements_, 0) << "no pressure was measured";
  EXPECT_EQ(end(*driver), 0) << driver->printed();
}

/// A terminal by pymodbus; its standard input is a pipe.
class ValvesAtPymodbus : public ValvesProgram {
 protected:
  static bool installed() {
    return std::system(
               "/usr/bin/python3 -c 'import pymodbus.server, pymodbus.client' >/dev/null 2>&1") ==
           0;
  }
  void SetUp() override {
    if (!installed()) GTEST_SKIP() << "no pymodbus for /usr/bin/python3: tools/install_packages";
    ValvesProgram::SetUp();
  }
  std::unique_ptr<Process> python(const std::string& script, const std::string& arguments) {
    return std::make_unique<Process>(
        "//bin/sh",
        std::vector<std::string>{"-c", "exec /usr/bin/python3 -B " SOFTARM_SOURCE_DIR
                                       "/tests/integration/valves/" +
                                           script + " " + arguments},
        folder_ / (script + ".output"));
  }
  void begin(const std::string& more = "") {
    pipe_ = (folder_ / "orders").string();
    ASSERT_EQ(mkfifo(pipe_.c_str(), 0600), 0);
    terminal_ = python("pymodbus_terminal.py", "12 40003 45395 46100" + more + " <>" + pipe_);
    ASSERT_GT(terminal_->port(), 0) << terminal_->printed();
    configure(terminal_->port());
    driver_ = start("softarm-valves");
  }
  void order(const std::string& line) { std::ofstream(pipe_) << line << std::endl; }
  struct State {
    int now = -1, largest = -1, negative = -1, timeout_ms = -1;
  };
  State state_of_terminal() {
    // pymodbus logs between the answers.
    const std::regex answer("state (\\d+) (\\d+) (\\d+) (\\d+)\n");
    std::string printed;
    const auto answers = [&] {
      printed = terminal_->printed();
      return std::distance(std::sregex_iterator(printed.begin(), printed.end(), answer), {});
    };
    const auto before = answers();
    order("state");
    EXPECT_TRUE(wait_for([&] { return answers() > before; })) << printed;
    State state;
    for (std::sregex_iterator at(printed.begin(), printed.end(), answer), end; at != end; ++at)
      state = {std::stoi((*at)[1]), std::stoi((*at)[2]), std::stoi((*at)[3]), std::stoi((*at)[4])};
    return state;
  }

  std::string pipe_;
  std::unique_ptr<Process> terminal_, driver_;
};

TEST_F(ValvesAtPymodbus, AForeignTerminalIsSecuredDrivenDegradedAndVented) {
  begin();
  ASSERT_TRUE(command_until(0.7, [&] {
    return valves().state == ValveState::running && measured_.pressure_bar.size() == kChambers &&
           std::abs(measured_.pressure_bar[11] - 0.7F) < 1e-3F;
  })) << driver_->printed();
  State there = state_of_terminal();
  EXPECT_EQ(there.largest, 700);
  EXPECT_EQ(there.negative, 0);
  EXPECT_EQ(there.timeout_ms, 300);
  order("diagnosis 4 8");
  ASSERT_TRUE(command_until(0.7, [&] { return is(ValveState::degraded, ValveReason::diagnosis); }))
      << driver_->printed();
  EXPECT_EQ(valves().chamber, 4);
  ASSERT_TRUE(wait_for([&] { return state_of_terminal().now == 0; }));
  order("diagnosis 4 0");
  ASSERT_TRUE(command_until(0.7, [&] { return valves().state == ValveState::running; }))
      << driver_->printed();
  EXPECT_EQ(end(*driver_), 0) << driver_->printed();
  EXPECT_EQ(state_of_terminal().now, 0);
}

TEST_F(ValvesAtPymodbus, ATerminalThatDoesNotTakeItsTimeOutIsNeverPressurised) {
  begin(" refuse");
  ASSERT_TRUE(command_until(0.7, [&] {
    return is(ValveState::disconnected, ValveReason::failsafe_refused);
  })) << driver_->printed();
  EXPECT_TRUE(command_until(0.7, [&] { return valves().connections > 0; }));
  EXPECT_EQ(state_of_terminal().largest, 0);
  EXPECT_TRUE(wait_for([&] {
    return driver_->printed().find(
               "fail-safe time-out refused: set 0.3 s at register 46100, read "
               "back 0 s") != std::string::npos;
  })) << driver_->printed();
}

TEST_F(ValvesAtPymodbus, AForeignClientFindsTheSimulatedTerminalAsItShouldBe) {
  configure(1);
  const auto plant = start_terminal();
  const auto client = python("pymodbus_client.py", std::to_string(plant->port()));
  EXPECT_EQ(end_of(*client), 0) << client->printed();
}

TEST_F(ValvesProgram, TheDaemonClosesTheLoopThroughEveryInterface) {
  configure(1);
  const auto plant = start_terminal();
  configure(plant->port(), ", rate_hz: 200, response_timeout_s: 0.0049");
  const auto driver = start("softarm-valves");
  const auto daemon = start("softarmd");
  // Two seconds into (24) every segment is bent by 0.4 rad.
  EXPECT_TRUE(wait_for([&] {
    return plant_.segments() == 3 && std::abs(plant_.u_rad.tail<2>().norm() - 0.4) < 0.05;
  })) << driver->printed()
      << daemon->printed();
  EXPECT_EQ(end(*daemon), 0) << daemon->printed();
  EXPECT_TRUE(wait_for([&] { return pressure_is(0.0); })) << driver->printed();
}

}  // namespace
}  // namespace softarm
