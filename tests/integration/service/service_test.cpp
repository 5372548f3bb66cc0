// softarmd and softarm-valves under a stand-in for systemd: what they tell it, and when they stop
// telling it.
#include <gtest/gtest.h>

#include "integration/processes/station.hpp"
#include "notify_socket.hpp"

namespace softarm {
namespace {

using test::AddressKind;
using test::NotifySocket;

constexpr int kWatchdog_ms = 300;

class Service : public ::testing::TestWithParam<AddressKind>, protected test::Station {
 protected:
  void SetUp() override {
    try {
      listen();
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
    arm_when_asked();
    setenv("WATCHDOG_USEC", std::to_string(1000 * kWatchdog_ms).c_str(), 1);
  }

  /// Reads on until the manager received this; what came later stays to be read.
  bool hears(const std::string& text) {
    const auto reads_it = [&] {
      for (std::string message = manager_.next(); !message.empty(); message = manager_.next()) {
        heard_ += message;
        if (message.find(text) != std::string::npos) return true;
      }
      return false;
    };
    return wait_for(reads_it);
  }

  NotifySocket manager_{GetParam()};
  std::string heard_;
};

TEST_P(Service, HearsOfReadinessModesHealthAndStop) {
  const auto daemon = start("softarmd");
  ASSERT_TRUE(hears("READY=1")) << daemon->printed();
  EXPECT_EQ(heard_.find("READY=1"), 0U) << "nothing comes before: " << heard_;
  const auto plant = start("softarm-plant");
  ASSERT_TRUE(hears("STATUS=ACTIVE\n")) << daemon->printed() << heard_;
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(hears("WATCHDOG=1")) << daemon->printed();

  daemon->stop();
  while (!manager_.next().empty()) {
  }
  EXPECT_EQ(manager_.next(kWatchdog_ms), "") << "now a manager takes it for dead";
  daemon->signal(SIGCONT);
  ASSERT_TRUE(hears("STATUS=VENT (time_gap)\n")) << daemon->printed();
  ASSERT_TRUE(hears("WATCHDOG=1")) << daemon->printed();

  ASSERT_TRUE(wait_for([&] { return under_pressure() && active_in_row_ > 0; }))
      << daemon->printed();
  daemon->signal(SIGTERM);
  ASSERT_TRUE(hears("STOPPING=1")) << daemon->printed();
  EXPECT_EQ(end_of(*daemon), 0) << daemon->printed();
  EXPECT_TRUE(wait_for([&] { return reason() == Reason::shutdown; }));
  EXPECT_TRUE(wait_for([&] { return largest(command_.pressure_bar) == 0.0F; }))
      << "the last command is vent";
  EXPECT_FALSE(heard_.find("STOPPING=1") < heard_.find("STATUS=ACTIVE"));
}

TEST_P(Service, GetsNoHealthReportThatItDidNotAskThisProcessFor) {
  setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  const auto daemon = start("softarmd");
  ASSERT_TRUE(hears("READY=1")) << daemon->printed();
  // Six watchdog messages would have come meanwhile.
  ASSERT_TRUE(wait_for([&] { return statuses_ > 500; })) << daemon->printed();
  daemon->signal(SIGTERM);
  ASSERT_TRUE(hears("STOPPING=1")) << daemon->printed();
  EXPECT_EQ(end_of(*daemon), 0) << daemon->printed();
  EXPECT_EQ(heard_.find("WATCHDOG"), std::string::npos) << heard_;
}

TEST_P(Service, IsNotNotifiedThatAWrongConfigurationIsReady) {
  write_config("paper_arm.yaml", "  no_such_key: 1\n");
  for (const char* program : {"softarmd", "softarm-valves"})
    EXPECT_EQ(end_of(*start(program)), 78) << program;
  EXPECT_EQ(manager_.next(), "");
}

TEST_P(Service, HearsOfValvesWithoutATerminal) {
  write_config("paper_arm_modbus.yaml", "", "valves: {port: 9}\n");
  const auto valves = start("softarm-valves");
  ASSERT_TRUE(hears("READY=1")) << valves->printed();
  ASSERT_TRUE(heard_.find("DISCONNECTED (no connection)") != std::string::npos ||
              hears("STATUS=DISCONNECTED (no connection)"))
      << valves->printed() << heard_;
  ASSERT_TRUE(hears("WATCHDOG=1")) << valves->printed();
  valves->signal(SIGTERM);
  ASSERT_TRUE(hears("STOPPING=1")) << valves->printed();
  EXPECT_EQ(end_of(*valves), 0) << "nothing was ever written: " << valves->printed();
}

INSTANTIATE_TEST_SUITE_P(Sockets, Service,
                         ::testing::Values(AddressKind::path, AddressKind::abstract),
                         [](const auto& kind) {
                           return kind.param == AddressKind::path ? "Path" : "Abstract";
                         });

}  // namespace
}  // namespace softarm
