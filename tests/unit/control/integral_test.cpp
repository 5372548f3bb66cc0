// Integral action: it removes what a wrong model leaves, and does not wind up.
#include <gtest/gtest.h>

#include <cmath>

#include "unit/control/arms.hpp"

namespace softarm {
namespace {

using Eigen::VectorXd;

struct End {
  VectorXd u, integral;
};

/// `seconds` of the paper's arm at 1 kHz towards `target`, every segment's force bounded to
/// `reach_nm` (as a box: enough to saturate), controlled with the model `modelled`.
End settle(const ArmParameters& modelled, const ArmParameters& real, double ki, double reach_nm,
           const VectorXd& target, double seconds, CurvatureController* keep = nullptr) {
  const int dof = real.dof();
  ControllerSettings settings = test::gains(real.size(), 1.0, 0.002);
  settings.ki.assign(static_cast<std::size_t>(dof), ki);
  CurvatureController own(modelled, settings);
  CurvatureController& controller = keep != nullptr ? *keep : own;
  DynamicsWorkspace workspace(real);
  const VectorXd zero = VectorXd::Zero(dof);
  const ReferenceWindow window = test::at(target, zero, zero);
  VectorXd state = VectorXd::Zero(2 * dof), accel(dof), scale(real.size());
  ControlOutput out;
  const double dt = 1e-3;
  for (int k = 0; k < static_cast<int>(seconds / dt); ++k) {
    controller.compute(state.head(dof), state.tail(dof), window, out);
    for (int i = 0; i < real.size(); ++i) {
      const double size = out.tau_u_nm.segment<2>(2 * i).norm();
      scale[i] = size > reach_nm ? reach_nm / size : 1.0;
      out.tau_u_nm.segment<2>(2 * i) *= scale[i];
    }
    controller.integrate(dt, state.head(dof), window.now, scale);
    const auto rate = [&](double, const VectorXd& s) {
      VectorXd r(2 * dof);
      forward_dynamics(real, workspace, s.head(dof), s.tail(dof), out.tau_u_nm, accel);
      r << s.tail(dof), accel;
      return r;
    };
    for (int j = 0; j < 4; ++j) test::runge_kutta(rate, 0.0, dt / 4, state);
  }
  return {state.head(dof), controller.integral_nm()};
}

ArmParameters stiffer(ArmParameters arm) {
  for (SegmentParameters& segment : arm.segments) segment.stiffness_nm_per_rad *= 1.2;
  return arm;
}

TEST(IntegralAction, RemovesTheOffsetOfAWrongStiffness) {
  const ArmParameters arm = test::paper_arm(2);
  VectorXd target(4);
  target << 0.3, -0.2, 0.1, 0.25;
  const VectorXd without = settle(arm, stiffer(arm), 0.0, 1e3, target, 4.0).u - target;
  const VectorXd with = settle(arm, stiffer(arm), 5.0, 1e3, target, 4.0).u - target;
  EXPECT_GT(without.lpNorm<Eigen::Infinity>(), 0.01);
  EXPECT_LT(with.lpNorm<Eigen::Infinity>(), 1e-5);
}

TEST(IntegralAction, HoldsJustWhatTheModelLacks) {
  const ArmParameters arm = test::paper_arm(1);
  const VectorXd target = Eigen::Vector2d(0.4, 0.0);
  const End end = settle(arm, stiffer(arm), 5.0, 1e3, target, 4.0);
  EXPECT_NEAR(end.integral[0], 0.2 * arm.segments[0].stiffness_nm_per_rad * 0.4, 1e-5);
  EXPECT_NEAR(end.integral[1], 0.0, 1e-9);
}

TEST(IntegralAction, StaysBoundedOutOfReachAndLetsGoAtOnce) {
  const ArmParameters arm = test::paper_arm(1);
  const double reach_nm = 0.3;  // holds about 0.4 rad
  ControllerSettings settings = test::gains(1, 1.0, 0.002);
  settings.ki.assign(2, 5.0);
  CurvatureController controller(arm, settings);
  settle(arm, arm, 5.0, reach_nm, Eigen::Vector2d(1.5, 0.0), 3.0, &controller);
  const double early_nm = controller.integral_nm()[0];
  settle(arm, arm, 5.0, reach_nm, Eigen::Vector2d(1.5, 0.0), 10.0, &controller);
  EXPECT_LT(std::abs(controller.integral_nm()[0]), reach_nm);
  EXPECT_NEAR(controller.integral_nm()[0], early_nm, 1e-3);
  // Back within reach it is as good as one that never was out of it.
  const End end = settle(arm, arm, 5.0, reach_nm, Eigen::Vector2d(0.1, 0.0), 3.0, &controller);
  EXPECT_NEAR(end.u[0], 0.1, 1e-4);
  controller.reset_integral();
  EXPECT_TRUE(controller.integral_nm().isZero(0.0));
}

TEST(IntegralAction, NoGainNoDifference) {
  const ArmParameters arm = test::paper_arm(1);
  const VectorXd target = Eigen::Vector2d(0.4, 0.1);
  ControllerSettings settings = test::gains(1, 1.0, 0.002);
  CurvatureController none(arm, settings);  // ki left empty
  EXPECT_EQ(settle(arm, stiffer(arm), 0.0, 1e3, target, 0.5).u,
            settle(arm, stiffer(arm), 0.0, 1e3, target, 0.5, &none).u);
}

TEST(IntegralAction, RefusesGainsThatDoNotFit) {
  ControllerSettings settings = test::gains(2, 1.0, 0.0);
  settings.ki = {1.0, 1.0};
  EXPECT_THROW(CurvatureController(test::paper_arm(2), settings), std::invalid_argument);
}

}  // namespace
}  // namespace softarm
