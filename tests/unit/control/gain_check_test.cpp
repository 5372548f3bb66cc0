#include "softarm/control/gain_check.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <deque>

#include "unit/control/arms.hpp"

namespace softarm {
namespace {

using Eigen::VectorXd;

double limit(const ArmParameters& arm, const ControllerSettings& settings, double kd = 0.0) {
  return largest_gain_factor(arm, settings, VectorXd::Ones(arm.dof()),
                             VectorXd::Constant(arm.dof(), kd));
}

/// Does a small error grow? The arm itself (not linearized), a true dead time, a true lag, gains in
/// u.
bool grows(const ArmParameters& arm, const ControllerSettings& settings, double kp) {
  const int dof = arm.dof();
  const double dt = 2.5e-4;
  ControllerSettings gains = settings;
  gains.kp.assign(static_cast<std::size_t>(dof), kp);
  gains.kd.assign(static_cast<std::size_t>(dof), 0.0);
  gains.valve_lag_s = 0.0;
  CurvatureController controller(arm, gains);
  DynamicsWorkspace workspace(arm);
  const VectorXd zero = VectorXd::Zero(dof);
  const ReferenceWindow window = test::at(zero, zero, zero);
  VectorXd state = VectorXd::Zero(2 * dof), force = zero, accel(dof);
  state.head(dof) << VectorXd::LinSpaced(dof, 1e-4, 2e-4);
  const auto delay = static_cast<std::size_t>(std::lround(settings.delay_s / dt));
  std::deque<VectorXd> line(delay, zero);
  ControlOutput out;
  double early = 0.0, late = 0.0;
  for (int i = 0; i < 12000; ++i) {
    controller.compute(state.head(dof), state.tail(dof), window, out);
    line.push_back(out.tau_u_nm);
    const VectorXd arrived = line.front();
    line.pop_front();
    if (settings.valve_lag_s > 0.0) {
      force += dt / settings.valve_lag_s * (arrived - force);
    } else {
      force = arrived;
    }
    const auto rate = [&](double, const VectorXd& s) {
      VectorXd r(2 * dof);
      forward_dynamics(arm, workspace, s.head(dof), s.tail(dof), force, accel);
      r << s.tail(dof), accel;
      return r;
    };
    test::runge_kutta(rate, 0.0, dt, state);
    const double size = state.head(dof).lpNorm<Eigen::Infinity>();
    if (i >= 2000 && i < 4000) early = std::max(early, size);
    if (i >= 10000) late = std::max(late, size);
  }
  return !(late < early);
}

TEST(GainCheck, ThePapersArmWithRealisticDelay) {
  // Prototypes: about 2.1 N m/rad with 20 ms of lag and 7.5 ms of delay, 2 rings, 2.5 is unstable.
  ControllerSettings settings = test::gains(3, 1.0, 0.002);
  settings.valve_lag_s = 0.02;
  settings.delay_s = 0.0075;
  const double kp = limit(test::paper_arm(3), settings, 0.002);
  EXPECT_GT(kp, 1.6);
  EXPECT_LT(kp, 2.3);
}

TEST(GainCheck, AgreesWithTheSimulatedLoop) {
  const ArmParameters arm = test::paper_arm(3);
  ControllerSettings settings = test::gains(3, 1.0, 0.0);
  for (const auto& [lag, delay] : {std::pair{0.02, 0.0075}, {0.0, 0.0075}}) {
    settings.valve_lag_s = lag;
    settings.delay_s = delay;
    const double kp = limit(arm, settings);
    EXPECT_FALSE(grows(arm, settings, 0.93 * kp)) << lag << " " << delay << " " << kp;
    EXPECT_TRUE(grows(arm, settings, 1.07 * kp)) << lag << " " << delay << " " << kp;
  }
}

TEST(GainCheck, MoreDelayLeavesLess) {
  ControllerSettings settings = test::gains(3, 1.0, 0.0);
  double before = 1e9;
  for (double delay : {0.0, 0.002, 0.004, 0.008, 0.016}) {
    settings.delay_s = delay;
    settings.valve_lag_s = 0.02;
    const double kp = limit(test::paper_arm(3), settings);
    EXPECT_LT(kp, before);
    before = kp;
  }
  settings.delay_s = settings.valve_lag_s = 0.0;
  EXPECT_EQ(limit(test::paper_arm(3), settings), 1e3);
}

TEST(GainCheck, WarnsOfThePapersGainsOnlyWhereDelayForbidsThem) {
  const ArmParameters arm = test::paper_arm(3);
  ControllerSettings settings = test::gains(3, 0.0, 0.0);
  settings.coordinates = ControlCoordinates::polar;
  settings.kp = {1.2, 0.0, 1.1, 0.0, 1.0, 0.0};
  settings.kd = {0.002, 0.0, 0.002, 0.0, 0.002, 0.0};
  EXPECT_TRUE(gain_warnings(arm, settings, 0.4).empty());
  settings.delay_s = 0.003;
  EXPECT_TRUE(gain_warnings(arm, settings, 0.4).empty());
  EXPECT_FALSE(gain_warnings(arm, settings, 0.1).empty());  // K_P / theta^2 = 120 N m/rad
  settings.valve_lag_s = 0.02;
  const std::vector<std::string> warnings = gain_warnings(arm, settings, 0.4);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("7.5 N m/rad"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[0].find("phi"), std::string::npos);
}

TEST(GainCheck, WarnsOfGainsInUWithAMargin) {
  const ArmParameters arm = test::paper_arm(3);
  ControllerSettings settings = test::gains(3, 1.0, 0.002);
  settings.valve_lag_s = 0.02;
  settings.delay_s = 0.0075;
  EXPECT_TRUE(gain_warnings(arm, settings, 0.4).empty());
  settings.kp.assign(6, 1.7);
  ASSERT_EQ(gain_warnings(arm, settings, 0.4).size(), 2u);  // one a bending plane
  EXPECT_NE(gain_warnings(arm, settings, 0.4)[0].find("within"), std::string::npos);
  settings.kp.assign(6, 2.5);
  EXPECT_NE(gain_warnings(arm, settings, 0.4)[0].find("beyond"), std::string::npos);
}

}  // namespace
}  // namespace softarm
