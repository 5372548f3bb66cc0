// Kinematics against integration along the arc and finite differences.
#include "softarm/model/kinematics.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "random_arm.hpp"
#include "softarm/model/segment.hpp"

namespace softarm {
namespace {

using testing_support::RandomArm;

/// Bends a straight arc in small steps: each turns by u/steps and advances by L/steps (midpoint
/// rule).
Eigen::Isometry3d integrate_arc(double length, const Eigen::Vector2d& u) {
  constexpr int kSteps = 20000;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d axis(-u.y(), u.x(), 0.0);
  const double half = 0.5 * axis.norm() / kSteps;
  const Eigen::AngleAxisd half_turn(half, axis.normalized());
  for (int i = 0; i < kSteps; ++i) {
    pose.rotate(half_turn);
    pose.translate(Eigen::Vector3d(0, 0, length / kSteps));
    pose.rotate(half_turn);
  }
  return pose;
}

TEST(Segment, IsAnArcOfConstantCurvature) {
  for (const auto& u : {Eigen::Vector2d(0.4, 0.0), Eigen::Vector2d(-1.2, 0.7),
                        Eigen::Vector2d(2.0, 2.0), Eigen::Vector2d(-4.0, 3.0)}) {
    const Eigen::Isometry3d pose = integrate_arc(0.3, u);
    EXPECT_TRUE(segment_rotation(u).isApprox(pose.linear(), 1e-9));
    EXPECT_LT((segment_tip(0.3, u) - pose.translation()).norm(), 1e-8);
    EXPECT_LT((segment_point(0.3, u, 0.5) - segment_tip(0.15, 0.5 * u)).norm(), 1e-16);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    constexpr int kPoints = 2000;
    for (int i = 0; i < kPoints; ++i) mean += segment_point(0.3, u, (i + 0.5) / kPoints) / kPoints;
    EXPECT_LT((segment_centre(0.3, u) - mean).norm(), 1e-7);
  }
}

TEST(Segment, PositiveThetaBendsTowardsPhi) {
  const Eigen::Vector2d u(0.3, 0.4);
  const Eigen::Vector3d tip = segment_tip(1.0, u);
  EXPECT_GT(tip.head<2>().dot(u), 0.0);
  EXPECT_NEAR(tip.x() * u.y(), tip.y() * u.x(), 1e-16);
}

TEST(Kinematics, PosesChain) {
  RandomArm random(1);
  const ArmParameters arm = random.arm(4, MassModel::point);
  const Eigen::VectorXd u = random.bending(4, 3.0);
  std::vector<Eigen::Isometry3d> ends(4);
  forward_kinematics(arm, u, ends);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = arm.base_rotation;
  pose.translation() = arm.base_position_m;
  for (int i = 0; i < 4; ++i) {
    Eigen::Isometry3d step = Eigen::Isometry3d::Identity();
    const Eigen::Vector2d bend = u.segment<2>(2 * i);
    step.linear() = segment_rotation(bend);
    step.translation() = segment_tip(arm.segments[static_cast<std::size_t>(i)].length_m, bend);
    pose = pose * step;
    EXPECT_TRUE(ends[static_cast<std::size_t>(i)].isApprox(pose, 1e-14));
  }
  EXPECT_TRUE(tip_pose(arm, u).isApprox(ends.back(), 1e-14));
  EXPECT_TRUE(tip_position(arm, u).isApprox(ends.back().translation(), 1e-14));
}

TEST(Kinematics, JacobiansMatchFiniteDifferences) {
  RandomArm random(2);
  for (const int n : {1, 3, 8}) {
    const ArmParameters arm = random.arm(n, MassModel::point);
    const auto state = random.state(n, 4.0);
    Eigen::Matrix3Xd J(3, 2 * n), rate(3, 2 * n), angular(3, 2 * n), only_J(3, 2 * n),
        only_rate(3, 2 * n);
    tip_jacobians(arm, state.u, state.v, J, rate);
    tip_angular_jacobian(arm, state.u, angular);
    tip_jacobian(arm, state.u, only_J);
    tip_jacobian_rate(arm, state.u, state.v, only_rate);
    EXPECT_TRUE(only_J.isApprox(J, 1e-15));
    EXPECT_TRUE(only_rate.isApprox(rate, 1e-15));
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 2 * n; ++k) {
      Eigen::VectorXd above = state.u, below = state.u;
      above(k) += kStep;
      below(k) -= kStep;
      const Eigen::Vector3d slope =
          (tip_position(arm, above) - tip_position(arm, below)) / (2 * kStep);
      EXPECT_LT((J.col(k) - slope).norm(), 1e-9);
      const Eigen::Matrix3d turn = (tip_pose(arm, above).linear() - tip_pose(arm, below).linear()) /
                                   (2 * kStep) * tip_pose(arm, state.u).linear().transpose();
      EXPECT_LT((angular.col(k) - Eigen::Vector3d(turn(2, 1), turn(0, 2), turn(1, 0))).norm(),
                1e-8);
    }
    Eigen::Matrix3Xd later(3, 2 * n), earlier(3, 2 * n);
    tip_jacobian(arm, state.u + kStep * state.v, later);
    tip_jacobian(arm, state.u - kStep * state.v, earlier);
    EXPECT_LT((rate - (later - earlier) / (2 * kStep)).norm(), 1e-7);
  }
}

TEST(Kinematics, SmoothThroughTheStraightArm) {
  ArmParameters arm;
  arm.segments.resize(3);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(6);
  Eigen::Matrix3Xd straight(3, 6), bent(3, 6);
  tip_jacobian(arm, u, straight);
  EXPECT_NEAR(tip_position(arm, u).z(), -0.33, 1e-15);
  for (const double tiny : {1e-300, 1e-160, 1e-12}) {
    u.setConstant(tiny);
    tip_jacobian(arm, u, bent);
    EXPECT_TRUE(bent.isApprox(straight, 1e-11)) << tiny;
  }
}

}  // namespace
}  // namespace softarm
