// Targets of the tip over LCM: softarmd brings the simulated arm's tip there, and refuses what is
// out of reach, with its reason in the status.
#include "faults/softarmd/fault_test.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

using test::FaultTest;

class LiveTipOnTheWire : public FaultTest {
 protected:
  std::int64_t refused(LiveVerdict verdict) const {
    return status_.references_refused[static_cast<std::size_t>(verdict)];
  }
  double distance_m(const Eigen::Vector3d& target) const { return (plant_.tip_m - target).norm(); }
};

TEST_P(LiveTipOnTheWire, TheTipGoesToATargetAndNotToOneOutOfReach) {
  configure(*this, "", "", "reference: [{kind: live_tip, timeout_s: 0.2}]\n");
  const auto plant = start_plant(*this);
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return mode() == Mode::active; })) << seen_text();
  const ArmParameters arm = load_experiment(config_.string()).arm;
  Eigen::VectorXd u(arm.dof());
  u << 0.3, 0.1, 0.2, 0.2, 0.1, 0.3;
  const Eigen::Vector3d target = tip_position(arm, u);
  ASSERT_GT(distance_m(target), 0.03) << "the arm is there without a target";

  client_->send_tip_target(target);
  EXPECT_TRUE(wait_for([&] { return distance_m(target) < 0.003; })) << distance_m(target);
  EXPECT_EQ(refused(LiveVerdict::unreachable), 0) << seen_text();

  const Eigen::Vector3d beyond = arm.base_position_m + Eigen::Vector3d(0.0, 0.0, -1.0);
  const std::int64_t before = status_.tick;
  client_->send_tip_target(beyond);
  EXPECT_TRUE(wait_for([&] { return refused(LiveVerdict::unreachable) == 1; })) << seen_text();
  EXPECT_TRUE(wait_for([&] { return status_.tick > before + 500; }));
  EXPECT_EQ(mode(), Mode::active) << seen_text();
  EXPECT_LT(distance_m(target), 0.003) << "the target before stays in force";
}

INSTANTIATE_TEST_SUITE_P(UnderLoad, LiveTipOnTheWire, ::testing::Values(test::Machine::loaded));

}  // namespace
}  // namespace softarm
