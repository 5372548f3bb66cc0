// Commands are lost between the daemon and its valves for longer than they are valid, or than the
// valve side grants: the valves vent, and the daemon does not fill them again by itself.
#include <atomic>
#include <thread>

#include "faults/softarmd/fault_test.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/transport/lcm_node.hpp"

namespace softarm {
namespace {

using test::FaultTest;

/// Passes commands on from the daemon's channel to the valves', or loses them.
class CommandRelay {
 public:
  /// @param priority SCHED_FIFO, so that a busy machine loses no commands; 0: none
  CommandRelay(const std::string& url, int priority) : node_(url) {
    node_.subscribe("SOFTARM_PRESSURE_COMMAND", 64, [this](const ReceivedMessage& packet) {
      if (!loses) node_.publish_encoded("VALVES_COMMAND", packet.bytes);
    });
    thread_ = std::jthread([this, priority](const std::stop_token& stop) {
      if (priority > 0) apply_realtime_settings({.fifo = true, .priority = priority});
      while (!stop.stop_requested()) node_.wait_until(monotonic_now_ns() + 10'000'000);
    });
  }
  std::atomic<bool> loses{false};

 private:
  LcmNode node_;
  std::jthread thread_;
};

class LostCommands : public FaultTest {
 protected:
  /// Validities of the daemon's commands and of what the valve side grants.
  void expect_that_the_arm_stays_vented(double asked_s, double granted_s) {
    lcm_ = ", command_channel: VALVES_COMMAND";
    validity_s_ = granted_s;
    configure(*this);
    const auto plant = start_plant(*this);
    lcm_.clear();
    validity_s_ = asked_s;
    configure(*this, ", arming: explicit");
    CommandRelay relay(url_, loaded() ? test::kPlantPriority : 0);
    const auto daemon = start("softarmd");
    ASSERT_TRUE(wait_for([&] { return reason() == Reason::waiting_for_arm; })) << daemon->printed();
    EXPECT_EQ(client_->request(OperatorRequest::arm), RequestOutcome::done) << daemon->printed();
    ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text() << daemon->printed();
    if (granted_s < asked_s) {
      EXPECT_NE(daemon->printed().find("but the valve side lets them expire after"),
                std::string::npos)
          << daemon->printed();
      EXPECT_NE(plant->printed().find("commands ask to be held for"), std::string::npos)
          << plant->printed();
    }

    forget();
    relay.loses = true;
    ASSERT_TRUE(wait_for([&] { return plant_.vented; })) << plant->printed();
    relay.loses = false;
    EXPECT_TRUE(wait_for([&] { return saw(Mode::vent, Reason::command_expired); })) << seen_text();
    EXPECT_TRUE(becomes(*this, Mode::vent, Reason::waiting_for_arm))
        << seen_text() << daemon->printed();
    EXPECT_EQ(largest(command_.pressure_bar), 0.0);
    EXPECT_EQ(client_->request(OperatorRequest::arm), RequestOutcome::done) << daemon->printed();
    EXPECT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text();
  }
};

TEST_P(LostCommands, ForLongerThanTheyAreValid) { expect_that_the_arm_stays_vented(0.3, 0.3); }
TEST_P(LostCommands, ForLongerThanTheValveSideGrants) {
  expect_that_the_arm_stays_vented(0.5, 0.25);
}

SOFTARM_ON_BOTH_MACHINES(LostCommands);

}  // namespace
}  // namespace softarm
