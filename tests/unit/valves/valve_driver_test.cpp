// The driver with hardware that obeys the test: what it is asked to do, in which order, and what is
// written whatever it answers.
#include "softarm/valves/valve_driver.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "milliseconds.hpp"
#include "unit/valves/fake_backend.hpp"

namespace softarm {
namespace {

using test::FakeHardware;

/// A back end that is made by its name.
class NamedBackend : public test::FakeBackend {
 public:
  explicit NamedBackend(const ValveDriverSettings&) : FakeBackend(hardware_) {}

 private:
  FakeHardware hardware_;
};
const ValveBackendRegistration<NamedBackend> kRegistration("fake");

using test::kMs;
constexpr std::int64_t kDriverPeriod = 5 * kMs;

class Driver : public ::testing::Test {
 protected:
  void SetUp() override {
    settings.chambers = 2;
    settings.driver.order = {0, 1};
    make();
  }
  void make() {
    driver = std::make_unique<ValveDriver>(settings, std::make_unique<test::FakeBackend>(hardware),
                                           [this] { return now; });
  }
  bool cycle() {
    now += kDriverPeriod;
    driver->wake(now);
    const std::array<double, 2> wanted = {0.5, 1.0};
    if (commanding)
      driver->command({.sequence = sequence++, .validity_ns = 100 * kMs, .pressure_bar = wanted},
                      now);
    return driver->cycle(now);
  }
  bool reach(ValveState state) {
    for (int k = 0; k < 2000 && driver->guard().state() != state; ++k) cycle();
    return driver->guard().state() == state;
  }
  void run() {
    commanding = true;
    ASSERT_TRUE(reach(ValveState::running));
    for (int k = 0; k < 100; ++k) cycle();
    ASSERT_EQ(hardware.written_bar, (std::vector{0.5, 1.0}));
  }
  std::string text() {
    std::array<char, 200> buffer;
    return std::string(driver->text(buffer));
  }
  bool vented() const {
    return std::all_of(hardware.written_bar.begin(), hardware.written_bar.end(),
                       [](double bar) { return bar == 0.0; });
  }

  ValveGuardSettings settings;
  FakeHardware hardware;
  std::unique_ptr<ValveDriver> driver;
  std::int64_t now = 1000 * kMs;
  std::int64_t sequence = 0;
  bool commanding = false;
};

TEST_F(Driver, SecuresBeforeItWrites) {
  for (int k = 0; k < 4; ++k) cycle();
  EXPECT_EQ(hardware.calls,
            (std::vector<std::string>{"connect", "secure", "write", "read", "write"}));
  EXPECT_TRUE(vented());
}

TEST_F(Driver, WritesNothingButZeroToHardwareThatDoesNotConfirmItsTimeOut) {
  commanding = true;
  hardware.confirms = false;
  for (int k = 0; k < 5000; ++k) {
    EXPECT_FALSE(cycle());
    ASSERT_TRUE(vented());
  }
  EXPECT_EQ(std::count(hardware.calls.begin(), hardware.calls.end(), "read"), 0);
  EXPECT_EQ(
      text(),
      "DISCONNECTED (fail-safe time-out refused: a fault of the test); no pressure is written");
}

TEST_F(Driver, WhatIsReadBackBelongsToWhatWasWritten) {
  run();
  EXPECT_TRUE(cycle());
  EXPECT_EQ(driver->written_sequence(), sequence - 1);
  EXPECT_DOUBLE_EQ(driver->read_back().actual_bar[1], 1.0);
  EXPECT_EQ(text(), "RUNNING");
}

TEST_F(Driver, GivenUpTheHardwareGetsZeroOnceMoreAndTheConnectionIsClosed) {
  run();
  hardware.read_result = LinkResult::no_answer;
  for (int k = 0; k < 2; ++k) EXPECT_FALSE(cycle());
  hardware.calls.clear();
  EXPECT_FALSE(cycle());
  EXPECT_EQ(hardware.calls, (std::vector<std::string>{"read", "write", "close"}));
  EXPECT_TRUE(vented());
  EXPECT_EQ(text(), "DISCONNECTED (no answer in time): nowhere: a fault of the test");
  EXPECT_DOUBLE_EQ(driver->read_back().actual_bar[1], 1.0) << "what was read last";
}

TEST_F(Driver, ABrokenConnectionIsClosedWithoutAnotherWord) {
  run();
  hardware.read_result = LinkResult::broken;
  hardware.calls.clear();
  cycle();
  EXPECT_EQ(hardware.calls, (std::vector<std::string>{"read", "close"}));
}

TEST_F(Driver, PressuresThatAreNoNumbersAreNoAnswer) {
  run();
  hardware.has_nan = true;
  for (int k = 0; k < 3; ++k) EXPECT_FALSE(cycle());
  EXPECT_TRUE(vented());
  EXPECT_EQ(driver->guard().state(), ValveState::disconnected);
  EXPECT_EQ(driver->guard().counters().no_answers, 3);
  EXPECT_EQ(text(), "DISCONNECTED (no answer in time): nowhere: pressures that are not numbers");
}

// The clock is asked again after the decision: hardware that has vented meanwhile gets zero.
TEST_F(Driver, WhatWasDecidedBeforeAGapIsNotWrittenAfterIt) {
  run();
  now += kDriverPeriod;
  driver->wake(now);
  const std::int64_t decided_ns = now;
  now += 300 * kMs;
  driver->cycle(decided_ns);
  EXPECT_TRUE(vented());
  EXPECT_EQ(driver->guard().reason(), ValveReason::time_gap);
}

// A back end that breaks its promise and blocks is found by the next cycle.
TEST_F(Driver, ARequestThatLastedTooLongDegrades) {
  run();
  hardware.during_write = [this] { now += 300 * kMs; };
  cycle();
  hardware.during_write = [] {};
  cycle();
  EXPECT_EQ(driver->guard().state(), ValveState::degraded);
  EXPECT_TRUE(vented());
}

TEST_F(Driver, AStopIsOverOnceZeroIsConfirmed) {
  run();
  EXPECT_FALSE(driver->stopped(now));
  driver->stop(now);
  EXPECT_FALSE(driver->stopped(now)) << "not yet written";
  cycle();
  EXPECT_TRUE(vented());
  EXPECT_FALSE(driver->stopped(now)) << "not yet measured";
  cycle();
  EXPECT_TRUE(driver->stopped(now));
  EXPECT_TRUE(driver->guard().zero_confirmed());
}

TEST_F(Driver, AStopThatNobodyConfirmsEndsUnconfirmed) {
  settings.driver.tolerated_failures = 1'000'000;
  make();
  run();
  hardware.read_result = LinkResult::no_answer;
  driver->stop(now);
  int cycles = 0;
  while (!driver->stopped(now)) {
    ASSERT_LT(++cycles, 1000);
    cycle();
  }
  EXPECT_NEAR(cycles, 40, 2) << "0.2 s, then silence lets the hardware vent by itself";
  EXPECT_FALSE(driver->guard().zero_confirmed());
  EXPECT_EQ(driver->guard().reason(), ValveReason::zero_unconfirmed);
}

TEST_F(Driver, HardwareThatTakesNoZeroGetsNoFurtherRequest) {
  run();
  hardware.ignores_writes = true;
  commanding = false;
  ASSERT_TRUE(reach(ValveState::disconnected));
  EXPECT_EQ(text(),
            "DISCONNECTED (pressure does not fall): nowhere: chamber 1 reads 1.000 bar; nothing is "
            "sent, so that it vents by itself");
  EXPECT_EQ(hardware.calls.back(), "close");
  EXPECT_EQ(hardware.calls[hardware.calls.size() - 2], "write") << "of the cycle before";
  hardware.calls.clear();
  const std::int64_t since = now;
  while (hardware.calls.empty()) cycle();
  EXPECT_GT(now - since, 300 * kMs);
}

TEST_F(Driver, ATimeOutThatIsNoLongerWhatWasSetVentsAndIsSetAgain) {
  run();
  hardware.keeps_failsafe = false;
  ASSERT_TRUE(reach(ValveState::degraded));
  EXPECT_EQ(text(), "DEGRADED (fail-safe time-out changed: a fault of the test)");
  EXPECT_TRUE(vented());
  hardware.keeps_failsafe = true;
  hardware.calls.clear();
  cycle();
  EXPECT_EQ(hardware.calls, (std::vector<std::string>{"read", "secure", "write"}));
  EXPECT_TRUE(reach(ValveState::running));
}

TEST_F(Driver, AStopWithoutAConnectionIsOverAtOnce) {
  hardware.reachable = false;
  cycle();
  driver->stop(now);
  EXPECT_TRUE(driver->stopped(now));
  EXPECT_TRUE(driver->guard().zero_confirmed()) << "no pressure was ever written";
}

TEST_F(Driver, ABufferThatIsTooSmallCutsTheText) {
  hardware.reachable = false;
  cycle();
  std::array<char, 12> buffer;
  EXPECT_EQ(driver->text(buffer), "DISCONNECTED");
}

TEST(ValveBackends, AreFoundByName) {
  EXPECT_EQ(valve_backend_names(), (std::vector<std::string>{"fake", "modbus"}));
  ValveDriverSettings settings;
  settings.order = {0};
  EXPECT_EQ(make_valve_backend(settings, 2.0)->address(), "127.0.0.1:502 unit 1");
  settings.backend = "fake";
  EXPECT_EQ(make_valve_backend(settings, 2.0)->address(), "nowhere");
}

TEST(ValveBackends, AnUnknownNameIsRefusedWithThoseThatThereAre) {
  ValveDriverSettings settings;
  settings.backend = "modbuss";
  try {
    make_valve_backend(settings, 2.0);
    ADD_FAILURE() << "made";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(),
                 "valves.backend: expected one that this program has (fake, modbus), got modbuss");
  }
  EXPECT_THROW(ValveBackendRegistration<NamedBackend>("modbus"), std::invalid_argument);
}

}  // namespace
}  // namespace softarm
