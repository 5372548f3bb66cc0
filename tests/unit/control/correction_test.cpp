// (17) with a correction of the model: the closed loop (18) of the arm that it corrects to.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "softarm/control/curvature_controller.hpp"
#include "softarm/model/model_correction.hpp"
#include "unit/control/arms.hpp"

namespace softarm {
namespace {

using Eigen::VectorXd;

/// An arm of which every parameter, and gravity, is off.
struct OtherArm {
  ArmParameters arm;
  VectorXd gain;
  ModelCorrection correction;
};

OtherArm other_arm(const ArmParameters& arm, test::Random& random) {
  OtherArm out{arm, VectorXd::Ones(arm.dof()), {}};
  // One load for all: then it is a gravity that stands aslant.
  const Eigen::Vector2d load = random.vector(2, 0.3);
  const Eigen::Vector3d down = arm.gravity_mps2.normalized();
  const double g = arm.gravity_mps2.norm();
  out.arm.gravity_mps2 +=
      g * (load.x() * Eigen::Vector3d::UnitX() + load.y() * Eigen::Vector3d::UnitX().cross(down));
  out.correction.disturbance_nm = random.vector(arm.dof(), 0.2);
  for (int i = 0; i < arm.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    SegmentCorrection& off = out.correction.segment[k];
    off = {random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), load};
    out.arm.segments[k].stiffness_nm_per_rad *= 1.0 + off.stiffness;
    out.arm.segments[k].damping_nms_per_rad *= 1.0 + off.damping;
    out.gain.segment<2>(2 * i).setConstant(1.0 + off.gain);
  }
  return out;
}

/// u'' of `other` under tau_A.
VectorXd acceleration(const OtherArm& other, const VectorXd& u, const VectorXd& velocity,
                      const VectorXd& tau, const VectorXd& disturbance_nm) {
  DynamicsWorkspace workspace(other.arm);
  VectorXd force(u.size()), out(u.size());
  apply_actuation(other.arm, u, tau, force);
  force = force.cwiseProduct(other.gain) + disturbance_nm;
  EXPECT_TRUE(forward_dynamics(other.arm, workspace, u, velocity, force, out));
  return out;
}

TEST(Correction, LeavesTheClosedLoop18OfTheCorrectedArm) {
  test::Random random(11);
  for (int trial = 0; trial < 100; ++trial) {
    const int n = 1 + trial % 5, dof = 2 * n;
    const ArmParameters arm = test::random_arm(n, random);
    const OtherArm other = other_arm(arm, random);
    const ControllerSettings settings = test::gains(n, 0.8, 0.03);
    CurvatureController controller(arm, settings);
    const VectorXd u = random.vector(dof, 1.2), ud = random.vector(dof, 3.0),
                   ur = random.vector(dof, 1.2), urd = random.vector(dof, 3.0),
                   urdd = random.vector(dof, 10.0);
    ControlOutput out;
    controller.compute(u, ud, test::at(ur, urd, urdd), out, &other.correction);
    const VectorXd udd =
        acceleration(other, u, ud, out.tau_actuation_nm, other.correction.disturbance_nm);
    DynamicsWorkspace workspace(other.arm);
    Eigen::MatrixXd B(dof, dof), C(dof, dof);
    VectorXd G(dof), rest(dof);
    dynamics_matrices(other.arm, workspace, u, ud, B, C, G);
    rest = B * (urdd - udd) + C * (urd - ud);
    for (int j = 0; j < dof; ++j) {
      const SegmentParameters& segment = other.arm.segments[static_cast<std::size_t>(j / 2)];
      rest[j] += (segment.stiffness_nm_per_rad + 0.8) * (ur[j] - u[j]) +
                 (segment.damping_nms_per_rad + 0.03) * (urd[j] - ud[j]);
    }
    EXPECT_LT(rest.norm(), 1e-9 * (1.0 + (B * urdd).norm())) << trial;
  }
}

TEST(Correction, SettingsSayWhatIsUsed) {
  test::Random random(12);
  const ArmParameters arm = test::paper_arm(3);
  const OtherArm other = other_arm(arm, random);
  const VectorXd u = random.vector(6, 0.5), zero = VectorXd::Zero(6);
  const auto torque = [&](DisturbanceRejection rejection, const ModelCorrection* correction) {
    ControllerSettings settings = test::gains(3, 0.8, 0.03);
    settings.disturbance = rejection;
    CurvatureController controller(arm, settings);
    ControlOutput out;
    controller.compute(u, zero, test::at(u, zero, zero), out, correction);
    return out.tau_u_nm;
  };
  using enum DisturbanceRejection;
  const SegmentVector configured = torque(cancel, nullptr);
  EXPECT_EQ(torque(none, &other.correction), configured);
  EXPECT_NE(torque(model_only, &other.correction), configured);
  ModelCorrection no_disturbance = other.correction;
  no_disturbance.disturbance_nm.setZero();
  EXPECT_EQ(torque(model_only, &other.correction), torque(cancel, &no_disturbance));
  EXPECT_NE(torque(cancel, &other.correction), torque(model_only, &other.correction));
}

TEST(Correction, AWeakGainRaisesTheFeedbackUpToThreefoldAndTheRestInFull) {
  const ArmParameters arm = test::paper_arm(1);
  const Eigen::Vector2d u(0.3, 0.1), velocity(0.4, -0.2), zero(0.0, 0.0);
  const Eigen::Vector2d ahead = u + Eigen::Vector2d(0.02, -0.01);
  const auto torque = [&](double kp, double kd, const ModelCorrection* correction) -> VectorXd {
    CurvatureController controller(arm, test::gains(1, kp, kd));
    ControlOutput out;
    controller.compute(u, velocity, test::at(ahead, zero, zero), out, correction);
    return out.tau_u_nm;
  };
  const VectorXd feedback = 0.8 * (ahead - u) - 0.03 * velocity;
  const VectorXd model = torque(0.0, 0.0, nullptr);
  for (const double gain : {0.4, 0.0, -0.5, -0.6, -0.8, -0.9}) {
    ModelCorrection correction;
    correction.disturbance_nm = VectorXd::Zero(2);
    correction.segment[0].gain = gain;
    const VectorXd expected = model / (1.0 + gain) + std::min(1.0 / (1.0 + gain), 3.0) * feedback;
    EXPECT_LT((torque(0.8, 0.03, &correction) - expected).norm(), 1e-12) << gain;
  }
}

TEST(Correction, TheLagInverseCountsItIn) {
  // A reference that only stiffens its torque linearly: the inverse adds lag times its rate.
  const ArmParameters arm = test::paper_arm(1);
  ControllerSettings settings = test::gains(1, 0.0, 0.0);
  settings.valve_lag_s = 0.02;
  ModelCorrection correction;
  correction.disturbance_nm = VectorXd::Zero(2);
  correction.segment[0].stiffness = 0.5;
  CurvatureController controller(arm, settings);
  const Eigen::Vector2d u(0.3, 0.1), velocity(0.4, -0.2), zero(0.0, 0.0);
  ReferenceWindow window;
  window.now = test::at(u, velocity, zero).now;
  window.interval_s = 2.0 * controller.lookahead_s();
  window.before = window.after = window.now;
  window.before.u = u - controller.lookahead_s() * velocity;
  window.after.u = u + controller.lookahead_s() * velocity;
  ControlOutput with, without;
  controller.compute(u, velocity, window, with, &correction);
  controller.compute(u, velocity, window, without);
  const double k = arm.segments[0].stiffness_nm_per_rad;
  EXPECT_LT((with.tau_u_nm - without.tau_u_nm - 0.5 * k * (u + 0.02 * velocity)).norm(), 1e-12);
}

TEST(HorizontalLoad, IsTheShareOfAGravityThatStandsAslant) {
  test::Random random(13);
  for (const Eigen::Vector3d& gravity :
       {Eigen::Vector3d(0.0, 0.0, -9.81), Eigen::Vector3d(1.0, -2.0, 5.0),
        Eigen::Vector3d(-9.81, 0.0, 0.0)}) {
    ArmParameters arm = test::random_arm(4, random);
    arm.gravity_mps2 = gravity;
    const HorizontalLoad horizontal(arm);
    DynamicsWorkspace workspace(arm);
    const VectorXd u = random.vector(8, 1.5), zero = VectorXd::Zero(8);
    VectorXd x(8), y(8), down(8), aslant(8);
    horizontal.rows(u, workspace, x, y);
    inverse_dynamics(arm, workspace, u, zero, zero, zero, {false, false, true}, down);
    // x, y and down are G for three gravities of the same size at right angles: their squares sum
    // up to those for the world's axes.
    double of_axes = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      arm.gravity_mps2 = gravity.norm() * Eigen::Vector3d::Unit(axis);
      inverse_dynamics(arm, workspace, u, zero, zero, zero, {false, false, true}, aslant);
      of_axes += aslant.squaredNorm();
    }
    EXPECT_NEAR(x.squaredNorm() + y.squaredNorm() + down.squaredNorm(), of_axes, 1e-9 * of_axes);
  }
  ArmParameters floating = test::paper_arm(2);
  floating.gravity_mps2.setZero();
  DynamicsWorkspace workspace(floating);
  VectorXd x(4), y(4);
  HorizontalLoad(floating).rows(VectorXd::Constant(4, 0.3), workspace, x, y);
  EXPECT_EQ(x, VectorXd::Zero(4));
  EXPECT_EQ(y, VectorXd::Zero(4));
}

}  // namespace
}  // namespace softarm
