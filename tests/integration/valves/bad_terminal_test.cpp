// softarm-valves before a terminal that refuses, ignores or loses what is written, or obeys another
// master too. What must hold: the arm vents, nothing keeps it from venting, and the exit code is 0
// only where its measured pressure fell.
#include "dev/fault/bad_terminal.hpp"

#include <gtest/gtest.h>

#include <array>

#include "integration/valves/valves_program.hpp"
#include "softarm/valves/modbus_terminal.hpp"

namespace softarm {
namespace {

using test::kChambers;
using test::Process;
using test::ValvesProgram;

class ValvesAtABadTerminal : public ValvesProgram {
 protected:
  void begin(const std::string& valves = "") {
    configure(terminal_.port(), valves);
    driver_ = start("softarm-valves");
  }
  bool run_at(double bar) {
    return command_until(bar, [&] {
      return is(ValveState::running, ValveReason::none) &&
             std::abs(terminal_.pressure_bar() - bar) < 0.02;
    });
  }
  bool vented() const { return terminal_.pressure_bar() < 0.02; }
  /// The driver has a cycle every 50 ms and the terminal a time-out of 0.3 s; every cycle is two
  /// requests, or three.
  static constexpr int kRequestsOfATimeOut = 3 * 9;

  BadTerminal terminal_{kChambers};
  std::unique_ptr<Process> driver_;
};

TEST_F(ValvesAtABadTerminal, RefusedWritesAreFollowedBySilenceAndTheTerminalVents) {
  begin();
  ASSERT_TRUE(run_at(0.5)) << driver_->printed();
  terminal_.requests = 0;
  terminal_.writes = Writes::refused;
  // Commands go on; no restart of the connection keeps the pressure or brings it back.
  ASSERT_TRUE(command_until(0.5, [&] { return vented(); })) << driver_->printed();
  EXPECT_LE(terminal_.requests, kRequestsOfATimeOut) << "each kept the pressure for 0.3 s more";
  const std::int64_t connections = valves().connections;
  ASSERT_TRUE(command_until(0.5, [&] { return valves().connections > connections + 1; }));
  EXPECT_TRUE(vented());
  terminal_.writes = Writes::obeyed;
  // An operator has to look first: commands must be zero once.
  ASSERT_TRUE(command_until(0.5, [&] {
    return is(ValveState::vented, ValveReason::waiting_for_zero);
  })) << driver_->printed();
  ASSERT_TRUE(command_until(0.0, [&] { return valves().state == ValveState::running; }));
  EXPECT_TRUE(run_at(0.5));
}

TEST_F(ValvesAtABadTerminal, WritesThatAreAcknowledgedAndIgnoredAreFollowedBySilence) {
  begin();
  ASSERT_TRUE(run_at(0.5)) << driver_->printed();
  terminal_.writes = Writes::ignored;
  terminal_.requests = 0;
  // Commands stop, so zero is wanted.
  ASSERT_TRUE(wait_for([&] { return is(ValveState::disconnected, ValveReason::zero_unconfirmed); }))
      << driver_->printed();
  ASSERT_TRUE(wait_for([&] { return vented(); })) << driver_->printed();
  // 0.1 s until the command expires come before.
  EXPECT_LE(terminal_.requests, 2 * kRequestsOfATimeOut);
  EXPECT_NE(driver_->printed().find("pressure does not fall"), std::string::npos)
      << driver_->printed();
}

TEST_F(ValvesAtABadTerminal, AWriteThatIsLostDegrades) {
  begin();
  ASSERT_TRUE(run_at(0.5)) << driver_->printed();
  terminal_.writes = Writes::ignored;
  ASSERT_TRUE(command_until(0.6, [&] {
    return is(ValveState::degraded, ValveReason::echo_mismatch);
  })) << driver_->printed();
  terminal_.writes = Writes::obeyed;
  EXPECT_TRUE(run_at(0.6)) << driver_->printed();
}

TEST_F(ValvesAtABadTerminal, ExitCode0MeansThatMeasuredPressureHasFallen) {
  for (const Writes each : {Writes::obeyed, Writes::refused, Writes::ignored}) {
    SCOPED_TRACE(static_cast<int>(each));
    terminal_.writes = Writes::obeyed;
    begin();
    ASSERT_TRUE(run_at(0.5)) << driver_->printed();
    terminal_.writes = each;
    const int code = end(*driver_);
    const double bar = terminal_.pressure_bar();
    EXPECT_EQ(code, each == Writes::obeyed ? 0 : 1) << driver_->printed();
    if (each == Writes::obeyed) {
      EXPECT_LE(bar, 0.1);
    }
    EXPECT_TRUE(wait_for([&] { return vented(); })) << "nobody keeps it";
  }
  // A driver that has just started does not know either.
  terminal_.writes = Writes::obeyed;
  begin();
  ASSERT_TRUE(run_at(0.5)) << driver_->printed();
  terminal_.writes = Writes::ignored;
  end(*driver_, SIGKILL);
  begin();
  const int before = valve_statuses_;
  ASSERT_TRUE(wait_for([&] {
    return valve_statuses_ > before && valves().state != ValveState::disconnected;
  })) << driver_->printed();
  EXPECT_EQ(end(*driver_), 1) << driver_->printed();
}

/// Another client of the same terminal.
struct OtherClient : ModbusTerminal {
  explicit OtherClient(int port) : ModbusTerminal(settings(port)) {}
  static ValveDriverSettings settings(int port) {
    ValveDriverSettings settings;
    settings.port = port;
    settings.response_timeout_s = 5.0;
    return settings;
  }
};
const RegisterMap kMap = register_preset(TerminalKind::cpx_vppm);

TEST_F(ValvesAtABadTerminal, SetPointsOfAnotherMasterDegrade) {
  begin();
  ASSERT_TRUE(run_at(0.5)) << driver_->printed();
  OtherClient other(terminal_.port());
  ASSERT_TRUE(other.connect());
  const std::vector<std::uint16_t> theirs(kChambers, 1800);
  bool degraded = false;  // one that is written just before the driver's own goes unnoticed
  for (int k = 0; k < 20 && !degraded; ++k) {
    ASSERT_EQ(other.write(kMap.write_address, theirs), LinkResult::ok) << other.error();
    const int before = valve_statuses_;
    command_until(0.5, [&] {
      degraded |= is(ValveState::degraded, ValveReason::echo_mismatch);
      return degraded || valve_statuses_ > before + 3;
    });
  }
  EXPECT_TRUE(degraded) << driver_->printed();
  EXPECT_TRUE(command_until(0.5, [&] { return vented(); }));
}

TEST_F(ValvesAtABadTerminal, ATimeOutThatAnotherMasterSwitchedOffIsFoundAndSetAgain) {
  begin();
  ASSERT_TRUE(run_at(0.5)) << driver_->printed();
  EXPECT_EQ(terminal_.timeout_ms(), 300);
  OtherClient other(terminal_.port());
  ASSERT_TRUE(other.connect());
  const std::array<std::uint16_t, 1> never{0};
  ASSERT_EQ(other.write(kMap.timeout_address, never), LinkResult::ok) << other.error();
  EXPECT_TRUE(command_until(0.5, [&] {
    return is(ValveState::degraded, ValveReason::failsafe_changed);
  })) << driver_->printed();
  EXPECT_TRUE(command_until(0.5, [&] { return vented(); }));
  EXPECT_TRUE(command_until(0.5, [&] { return terminal_.timeout_ms() == 300; }))
      << driver_->printed();
  EXPECT_TRUE(run_at(0.5)) << driver_->printed();
  EXPECT_NE(driver_->printed().find("fail-safe time-out changed: set 0.3 s at register 46100, read "
                                    "back 0 s"),
            std::string::npos)
      << driver_->printed();
}

// The check of docs/how-to/connect_valves.md: the driver is killed while every other client stays.
TEST_F(ValvesProgram, WithTheDriverKilledNoReaderKeepsThePressure) {
  configure(1);
  const auto plant = start_terminal();
  configure(plant->port());
  const auto driver = start("softarm-valves");
  ASSERT_TRUE(command_until(0.5, [&] { return pressure_is(0.5); })) << driver->printed();
  OtherClient reader(plant->port());
  ASSERT_TRUE(reader.connect());
  end(*driver, SIGKILL);
  EXPECT_TRUE(command_until(0.5, [&] {
    std::array<std::uint16_t, 3> words{};
    EXPECT_EQ(reader.read(kMap.read_address, words), LinkResult::ok) << reader.error();
    return plant_.vented && plant_.pressure_bar[0] < 0.02;
  }));
}

}  // namespace
}  // namespace softarm
