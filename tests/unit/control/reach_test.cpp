// Points that the tip reaches by a known pose, and points that it cannot.
#include "softarm/control/reach.hpp"

#include <gtest/gtest.h>

#include <random>

#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

ArmParameters hanging(int segments) {
  ArmParameters arm;
  arm.segments.resize(static_cast<std::size_t>(segments));
  for (SegmentParameters& segment : arm.segments) segment.length_m = 0.11;
  arm.base_rotation = Eigen::Vector3d(1, -1, -1).asDiagonal();
  return arm;
}

TEST(Reach, WhatSomePoseReachesIsFound) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> bend(-1.2, 1.2);
  for (const int n : {1, 2, 3, 4}) {
    const ArmParameters arm = hanging(n);
    for (int k = 0; k < 200; ++k) {
      Eigen::VectorXd pose(2 * n), u = Eigen::VectorXd::Zero(2 * n);
      for (double& each : pose) each = bend(random);
      EXPECT_LT(distance_out_of_reach_m(arm, 2.0, std::nullopt, tip_position(arm, pose), u),
                1e-3 * n)
          << n << ": " << pose.transpose();
    }
  }
}

TEST(Reach, TheInsideOfAnArmOfOneSegmentIsOutOfReach) {
  Eigen::VectorXd u = Eigen::VectorXd::Zero(2);
  // An arc that ends on the axis is straight; at 0.06 m from the base nothing else is.
  EXPECT_GT(distance_out_of_reach_m(hanging(1), 2.0, std::nullopt, {0.0, 0.0, -0.06}, u), 0.02);
  // Farther than the arm is long, by as much.
  EXPECT_NEAR(distance_out_of_reach_m(hanging(1), 2.0, std::nullopt, {0.0, 0.0, -0.15}, u), 0.04,
              1e-6);
}

TEST(Reach, LimitsOnThetaAndThePlaneCount) {
  const ArmParameters arm = hanging(2);
  const Eigen::VectorXd pose = Eigen::VectorXd::Constant(4, 0.9);
  const Eigen::Vector3d target = tip_position(arm, pose);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(4);
  EXPECT_LT(distance_out_of_reach_m(arm, 2.0, std::nullopt, target, u), 1e-3);
  u.setZero();
  EXPECT_GT(distance_out_of_reach_m(arm, 0.4, std::nullopt, target, u), 0.02);
  u.setZero();
  EXPECT_GT(distance_out_of_reach_m(arm, 2.0, 0.0, target, u), 0.02);
}

}  // namespace
}  // namespace softarm
