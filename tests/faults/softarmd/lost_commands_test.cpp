// Commands are lost between the daemon and its valves for longer than they are valid, or than the
// valve side grants: the valves vent, and the daemon does not fill them again by itself.
#include "faults/softarmd/fault_test.hpp"

namespace softarm {
namespace {

using test::FaultTest;

class LostCommands : public FaultTest {
 protected:
  /// Validities of the daemon's commands and of what the valve side grants.
  void expect_that_the_arm_stays_vented(double asked_s, double granted_s) {
    lcm_ = ", command_channel: VALVES_COMMAND";
    validity_s_ = granted_s;
    configure(*this);
    const auto plant = start_plant(*this);
    // It has read the configuration, which is then the daemon's.
    ASSERT_TRUE(wait_for([&] { return plant_states_ > 0; })) << plant->printed();
    lcm_.clear();
    validity_s_ = asked_s;
    configure(*this, ", arming: explicit");
    FaultRelay relay(load_experiment(config_.string()).transport.lcm, "_NOBODY",
                     loaded() ? test::kPlantPriority : 0, "VALVES_COMMAND");
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
    relay.lose_commands(true);
    ASSERT_TRUE(wait_for([&] { return plant_.vented; })) << plant->printed();
    relay.lose_commands(false);
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
