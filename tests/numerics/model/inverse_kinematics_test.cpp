// (21): the law it promises for the tip, and what it does near singular J.
#include "softarm/control/inverse_kinematics.hpp"

#include <gtest/gtest.h>

#include "dense_solvers.hpp"
#include "softarm/model/kinematics.hpp"
#include "unit/model/random_arm.hpp"

namespace softarm {
namespace {

using testing_support::RandomArm;

TEST(InverseKinematics, TipFollowsTheErrorLaw) {
  RandomArm random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const ArmParameters arm = random.arm(3, MassModel::point);
    const auto s = random.state(3, 2.0);
    Eigen::Matrix3Xd J(3, 6), rate(3, 6);
    tip_jacobians(arm, s.u, s.v, J, rate);
    const Eigen::Vector3d p = tip_position(arm, s.u);
    const TipReference target{p + Eigen::Vector3d(random.vector(3, 0.05)), random.vector(3, 0.1),
                              random.vector(3, 0.2)};
    const InverseKinematicsGains gains{
        .lambda_1ps = 3.0, .lambda_position_1ps2 = 25.0, .lambda_velocity_1ps = 10.0};
    Eigen::VectorXd velocity(6), acceleration(6);
    ASSERT_TRUE(inverse_kinematics(gains, J, rate, s.v, p, target, velocity, acceleration));
    const double loss = 1e-12 / manipulability_ratio(J);
    EXPECT_LT((J * velocity - target.velocity_mps - 3.0 * (target.position_m - p)).norm(), loss);
    // p'' = J q'' + J' q' is the reference's plus the gains times the errors.
    const Eigen::Vector3d tip_acceleration = J * acceleration + rate * s.v;
    EXPECT_LT((tip_acceleration - target.acceleration_mps2 -
               10.0 * (target.velocity_mps - J * s.v) - 25.0 * (target.position_m - p))
                  .norm(),
              100.0 * loss);
    // Least norm: nothing in the null space of J.
    const Eigen::MatrixXd pinv = test::pseudo_inverse(J);
    EXPECT_LT((velocity - pinv * (J * velocity)).norm(), 10.0 * loss);
  }
}

TEST(InverseKinematics, SaysWhereJacobianIsSingularAndDampingBoundsIt) {
  ArmParameters straight;
  straight.segments.resize(3);
  const Eigen::VectorXd u = Eigen::VectorXd::Zero(6), v = u;
  Eigen::Matrix3Xd J(3, 6), rate(3, 6);
  tip_jacobians(straight, u, v, J, rate);
  const Eigen::Vector3d p = tip_position(straight, u);
  const TipReference target{p + Eigen::Vector3d(0.01, 0.0, 0.01), {0, 0, 0}, {0, 0, 0}};
  Eigen::VectorXd velocity(6), acceleration(6);
  EXPECT_FALSE(inverse_kinematics({}, J, rate, v, p, target, velocity, acceleration));
  EXPECT_EQ(velocity, Eigen::VectorXd::Zero(6));
  ASSERT_TRUE(
      inverse_kinematics({.damping_mprad = 0.01}, J, rate, v, p, target, velocity, acceleration));
  EXPECT_LT(velocity.norm(), 10.0);
  EXPECT_GT((J * velocity).x(), 0.0);
}

}  // namespace
}  // namespace softarm
