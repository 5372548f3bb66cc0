// softarm-valves between LCM and Modbus TCP, whole programs on both sides: the simulated arm's
// server through a relay that does harm, and pymodbus, which is not ours.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <regex>

#include "faults/preloaded_clocks.hpp"
#include "integration/valves/relay.hpp"
#include "integration/valves/valves_program.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;
using test::kChambers;
using test::Process;
using test::Relay;
using test::ValvesProgram;

/// The simulated arm, the relay, the driver.
class ValvesBehindARelay : public ValvesProgram {
 protected:
  void begin(const std::string& valves = "", const std::string& safety = "") {
    write_config(1, valves, safety);
    plant_process_ = start_plant();
    relay_ = std::make_unique<Relay>(plant_process_->port());
    write_config(relay_->port(), valves, safety);
    driver_ = start("softarm-valves");
  }
  void TearDown() override {
    if (relay_) {
      EXPECT_EQ(relay_->negative_set_points, 0);
    }
    driver_.reset();
    relay_.reset();
    plant_process_.reset();
    ValvesProgram::TearDown();
  }
  bool run_at(double bar) {
    return wait_for([&] { return is(ValveState::running, ValveReason::none) && pressure_is(bar); },
                    bar);
  }
  /// It came back by itself and the arm is under pressure again.
  void expect_recovery() { EXPECT_TRUE(run_at(0.3)) << driver_->printed(); }

  std::unique_ptr<Process> plant_process_, driver_;
  std::unique_ptr<Relay> relay_;
};

TEST_F(ValvesBehindARelay, CommandsReachTheArmExpireAndAStopVents) {
  begin();
  ASSERT_TRUE(run_at(0.4)) << driver_->printed() << plant_process_->printed();
  EXPECT_GE(measured_.sequence, 0);
  EXPECT_EQ(plant_.vented, 0);
  // Nothing is sent any more.
  ASSERT_TRUE(wait_for([&] {
    return is(ValveState::vented, ValveReason::no_command) && pressure_is(0.0);
  })) << driver_->printed();
  EXPECT_EQ(measured_.sequence, -1);
  ASSERT_TRUE(run_at(0.4));
  driver_->signal(SIGTERM);
  EXPECT_EQ(driver_->wait(1000ms), 0) << driver_->printed();
  EXPECT_TRUE(wait_for([&] { return plant_.vented != 0; }, 0.4)) << "its time-out, later";
  EXPECT_LT(plant_.pressure_bar[0], 0.02F);
  EXPECT_EQ(plant_process_->printed().find("behind"), std::string::npos);
}

TEST_F(ValvesBehindARelay, ShadowForeignAndHostileCommandsMoveNothing) {
  begin();
  ASSERT_TRUE(wait_for([&] { return state() == ValveState::vented; })) << driver_->printed();
  const auto publish_for_a_while = [&] {
    const int before = measurements_;
    EXPECT_TRUE(wait_for([&] {
      ++command_.sequence;
      node_->publish("SOFTARM_PRESSURE_COMMAND", command_);
      return measurements_ > before + 10;
    }));
  };
  command_.pressure_bar.assign(kChambers, 1.0F);
  command_.shadow = 1;
  publish_for_a_while();
  command_.shadow = 0;
  command_.pressure_bar[3] = std::nanf("");
  publish_for_a_while();
  command_.pressure_bar.assign(kChambers + 1, 1.0F);
  command_.num_chambers = kChambers + 1;
  publish_for_a_while();
  command_.pressure_bar.assign(kChambers, -1.0F);
  command_.num_chambers = kChambers;
  publish_for_a_while();
  EXPECT_TRUE(pressure_is(0.0));
  EXPECT_GT(status_.commands_refused, 0);
  command_.validity_us = 300'000;
  EXPECT_TRUE(run_at(0.2)) << "and it still takes good ones" << driver_->printed();
}

TEST_F(ValvesBehindARelay, LateAnswersVentAndAreSurvived) {
  begin();
  ASSERT_TRUE(run_at(0.3)) << driver_->printed();
  relay_->delay_us = 80'000;
  ASSERT_TRUE(wait_for([&] { return is(ValveState::disconnected, ValveReason::no_answer); }, 0.3))
      << driver_->printed();
  EXPECT_GT(status_.no_answers, 2);
  EXPECT_TRUE(wait_for([&] { return plant_.pressure_bar[0] < 0.02F; }, 0.3))
      << "by zero or time-out";
  relay_->delay_us = 0;
  expect_recovery();
}

TEST_F(ValvesBehindARelay, ExceptionRepliesVentAndAreSurvived) {
  begin();
  ASSERT_TRUE(run_at(0.3)) << driver_->printed();
  relay_->exceptions = true;
  ASSERT_TRUE(wait_for([&] { return is(ValveState::degraded, ValveReason::exception_reply); }, 0.3))
      << driver_->printed();
  ASSERT_TRUE(wait_for([&] { return plant_.pressure_bar[0] < 0.02F; }, 0.3));
  EXPECT_GT(status_.exceptions, 2);
  relay_->exceptions = false;
  expect_recovery();
}

TEST_F(ValvesBehindARelay, ADisconnectInTheMiddleOfAWriteVentsAndIsSurvived) {
  begin();
  for (int round = 0; round < 3; ++round) {
    ASSERT_TRUE(run_at(0.3)) << driver_->printed();
    const int before = status_.broken;
    relay_->refuse = round == 2;
    relay_->cut_next_write = true;
    ASSERT_TRUE(wait_for([&] { return status_.broken > before; }, 0.3)) << driver_->printed();
    EXPECT_TRUE(wait_for([&] { return plant_.pressure_bar[0] < 0.02F; }, 0.3));
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
  ASSERT_TRUE(wait_for([&] { return is(ValveState::degraded, ValveReason::stuck_valve); }, 0.3))
      << driver_->printed();
  EXPECT_EQ(status_.chamber, 5);
  EXPECT_TRUE(wait_for([&] { return plant_.pressure_bar[0] < 0.02F; }, 0.3));
  EXPECT_TRUE(wait_for(
      [&] { return driver_->printed().find("stuck valve): chamber 5") != std::string::npos; }));
  relay_->stuck_word = -1;
  ASSERT_TRUE(wait_for([&] { return is(ValveState::vented, ValveReason::waiting_for_zero); }, 0.3));
  ASSERT_TRUE(wait_for([&] { return state() == ValveState::running; }, 0.0));
  expect_recovery();
}

TEST_F(ValvesBehindARelay, ATerminalThatRestartsIsSecuredAgain) {
  begin();
  ASSERT_TRUE(run_at(0.3)) << driver_->printed();
  plant_process_->signal(SIGKILL);
  ASSERT_EQ(plant_process_->wait(5s), 128 + SIGKILL);
  ASSERT_TRUE(wait_for([&] { return state() == ValveState::disconnected; }, 0.3))
      << driver_->printed();
  plant_process_ = start_plant();
  relay_->server_port_ = plant_process_->port();
  expect_recovery();
  // Had its time-out not been set once more, this arm would keep its pressure.
  driver_->signal(SIGKILL);
  EXPECT_TRUE(wait_for([&] { return plant_.vented != 0 && plant_.pressure_bar[0] < 0.02F; }, 0.3));
}

TEST_F(ValvesBehindARelay, AStoppedAndContinuedDriverVents) {
  begin();
  ASSERT_TRUE(run_at(0.3)) << driver_->printed();
  driver_->signal(SIGSTOP);
  ASSERT_TRUE(wait_for([&] { return plant_.vented != 0; }, 0.3)) << "the terminal's own time-out";
  driver_->signal(SIGCONT);
  EXPECT_TRUE(wait_for([&] { return is(ValveState::degraded, ValveReason::time_gap); }, 0.3))
      << driver_->printed();
  expect_recovery();
}

#ifndef SOFTARM_SANITIZED  // a sanitizer's runtime must be loaded first
/// The same driver on clocks that the test sets.
class ValvesOnPausedMachines : public ValvesBehindARelay {
 protected:
  void begin_on_set_clocks() {
    clocks_ = std::make_unique<test::PreloadedClocks>((folder_ / "clocks").string());
    ASSERT_TRUE(clocks_->made());
    begin();
    driver_.reset();
    std::vector<std::string> arguments = clocks_->preload();
    arguments.push_back(std::string(SOFTARM_BINARY_DIR) + "/bin/softarm-valves");
    driver_ = start("/env", arguments);
    ASSERT_TRUE(run_at(0.3)) << driver_->printed();
  }
  std::unique_ptr<test::PreloadedClocks> clocks_;
};

TEST_F(ValvesOnPausedMachines, ASuspendVents) {
  begin_on_set_clocks();
  clocks_->suspend(5 * test::kSecond);
  EXPECT_TRUE(wait_for([&] { return is(ValveState::degraded, ValveReason::time_gap); }, 0.3))
      << driver_->printed();
  EXPECT_TRUE(wait_for([&] { return plant_.pressure_bar[0] < 0.02F; }, 0.3));
  expect_recovery();
}

// The terminal has vented by itself meanwhile. What it holds is read before it is written again.
TEST_F(ValvesOnPausedMachines, APauseThatNoClockCountsVentsToo) {
  begin_on_set_clocks();
  const std::int64_t stopped_ns = monotonic_now_ns();
  driver_->stop();
  ASSERT_TRUE(wait_for([&] { return plant_.vented != 0 && plant_.pressure_bar[0] < 0.02F; }, 0.3));
  clocks_->lose(monotonic_now_ns() - stopped_ns);
  float highest_bar = 0.0F;
  const int before = statuses_;
  driver_->signal(SIGCONT);
  EXPECT_TRUE(wait_for(
      [&] {
        highest_bar = std::max(highest_bar, plant_.pressure_bar[0]);
        return statuses_ > before && is(ValveState::degraded, ValveReason::echo_mismatch);
      },
      0.3))
      << driver_->printed();
  EXPECT_LT(highest_bar, 0.05F) << "it is not filled again";
  expect_recovery();
}
#endif

TEST_F(ValvesBehindARelay, WithExplicitArmingCommandsOfZeroComeFirst) {
  begin("", ", arming: explicit");
  ASSERT_TRUE(wait_for([&] { return is(ValveState::vented, ValveReason::no_command); }))
      << driver_->printed();
  wait_for([] { return false; }, -1.0, 0.3);  // longer than command_validity_s: that is silence
  ASSERT_TRUE(run_at(0.3)) << driver_->printed();
  relay_->cut_next_write = true;
  ASSERT_TRUE(wait_for([&] { return is(ValveState::vented, ValveReason::waiting_for_zero); }, 0.3))
      << driver_->printed();
  EXPECT_FALSE(wait_for([&] { return state() == ValveState::running; }, 0.3, 1.0));
  ASSERT_TRUE(wait_for([&] { return state() == ValveState::running; }, 0.0));
  expect_recovery();
}

TEST_F(ValvesBehindARelay, ASecondDriverIsKeptOut) {
  begin();
  ASSERT_TRUE(wait_for([&] { return state() == ValveState::vented; })) << driver_->printed();
  const auto same = start("softarm-valves");
  EXPECT_EQ(same->wait(5s), 75) << same->printed();
  const auto plant_of_lcm = start("softarm-plant");  // it would publish the same pressures
  EXPECT_EQ(plant_of_lcm->wait(5s), 75) << plant_of_lcm->printed();
  // Another arm by its channels, but the same terminal.
  std::ofstream(config_, std::ios::app) << "# other\n";
  const std::string text = [&] {
    std::ostringstream all;
    all << std::ifstream(config_).rdbuf();
    return all.str();
  }();
  std::ofstream(config_) << std::regex_replace(
      text, std::regex("lcm: \\{"), "lcm: {command_channel: OTHER, measurement_channel: OTHER_P, ");
  const auto other = start("softarm-valves");
  EXPECT_EQ(other->wait(5s), 75) << other->printed();
  EXPECT_NE(other->printed().find("terminal 127.0.0.1"), std::string::npos) << other->printed();
}

TEST_F(ValvesProgram, AStopWithoutATerminalIsNoError) {
  int free_port = 0;
  { free_port = Relay(1).port(); }
  write_config(free_port);
  const auto driver = start("softarm-valves");
  ASSERT_TRUE(wait_for([&] { return statuses_ > 3; }, 0.3)) << driver->printed();
  EXPECT_EQ(state(), ValveState::disconnected);
  EXPECT_EQ(measurements_, 0) << "no pressure was measured";
  driver->signal(SIGTERM);
  EXPECT_EQ(driver->wait(1000ms), 0) << driver->printed();
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
        (folder_ / (script + ".output")).string());
  }
  void begin(const std::string& more = "") {
    pipe_ = (folder_ / "orders").string();
    ASSERT_EQ(mkfifo(pipe_.c_str(), 0600), 0);
    terminal_ = python("pymodbus_terminal.py", "12 40003 45395 46100" + more + " <>" + pipe_);
    ASSERT_GT(terminal_->port(), 0) << terminal_->printed();
    write_config(terminal_->port());
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
  ASSERT_TRUE(wait_for(
      [&] {
        return state() == ValveState::running && measured_.pressure_bar.size() == kChambers &&
               std::abs(measured_.pressure_bar[11] - 0.7F) < 1e-3F;
      },
      0.7))
      << driver_->printed();
  State there = state_of_terminal();
  EXPECT_EQ(there.largest, 700);
  EXPECT_EQ(there.negative, 0);
  EXPECT_EQ(there.timeout_ms, 300);
  order("diagnosis 4 8");
  ASSERT_TRUE(wait_for([&] { return is(ValveState::degraded, ValveReason::diagnosis); }, 0.7))
      << driver_->printed();
  EXPECT_EQ(status_.chamber, 4);
  ASSERT_TRUE(wait_for([&] { return state_of_terminal().now == 0; }));
  order("diagnosis 4 0");
  ASSERT_TRUE(wait_for([&] { return state() == ValveState::running; }, 0.7)) << driver_->printed();
  driver_->signal(SIGTERM);
  EXPECT_EQ(driver_->wait(1000ms), 0) << driver_->printed();
  EXPECT_EQ(state_of_terminal().now, 0);
}

TEST_F(ValvesAtPymodbus, ATerminalThatDoesNotTakeItsTimeOutIsNeverPressurised) {
  begin(" refuse");
  ASSERT_TRUE(
      wait_for([&] { return is(ValveState::disconnected, ValveReason::failsafe_refused); }, 0.7))
      << driver_->printed();
  EXPECT_TRUE(wait_for([&] { return status_.connections > 0; }, 0.7));
  EXPECT_EQ(state_of_terminal().largest, 0);
  EXPECT_TRUE(wait_for([&] {
    return driver_->printed().find(
               "fail-safe time-out refused: set 0.3 s at register 46100, read "
               "back 0 s") != std::string::npos;
  })) << driver_->printed();
}

TEST_F(ValvesAtPymodbus, AForeignClientFindsTheSimulatedTerminalAsItShouldBe) {
  write_config(1);
  const auto plant = start_plant();
  const auto client = python("pymodbus_client.py", std::to_string(plant->port()));
  int code = -1;
  wait_for([&] { return (code = client->wait(0ms)) >= 0; }, -1.0, 60.0);
  EXPECT_EQ(code, 0) << client->printed();
}

TEST_F(ValvesProgram, TheDaemonClosesTheLoopThroughEveryInterface) {
  write_config(1);
  const auto plant = start_plant();
  write_config(plant->port(), ", rate_hz: 200, response_timeout_s: 0.0049");
  const auto driver = start("softarm-valves");
  const auto daemon = start("softarmd");
  // Two seconds into (24) every segment is bent by 0.4 rad.
  EXPECT_TRUE(wait_for([&] {
    return plant_.num_segments == 3 &&
           std::abs(std::hypot(plant_.u_rad[2][0], plant_.u_rad[2][1]) - 0.4) < 0.05;
  })) << driver->printed()
      << daemon->printed();
  daemon->signal(SIGTERM);
  EXPECT_EQ(daemon->wait(2000ms), 0) << daemon->printed();
  EXPECT_TRUE(wait_for([&] { return pressure_is(0.0); })) << driver->printed();
}

}  // namespace
}  // namespace softarm
