// The serial robot as such: any joints, any angles, masses anywhere, against the textbook's
// formulas and against differences.
#include "model/augmented_chain.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "random_arm.hpp"

namespace softarm {
namespace {

constexpr int kJoints = 7;
const Eigen::Vector3d kGravity(1.0, -2.0, -9.0);

std::vector<DhJoint> odd_robot(testing_support::RandomArm& random) {
  std::vector<DhJoint> joints;
  for (int j = 0; j < kJoints; ++j) {
    const double alpha = random.uniform(-2.0, 2.0);
    joints.push_back({.prismatic = j % 3 == 1,
                      .fixed = random.uniform(-0.5, 0.5),
                      .a = random.uniform(-0.5, 0.5),
                      .cos_alpha = std::cos(alpha),
                      .sin_alpha = std::sin(alpha),
                      .mass_kg = j % 2 == 0 ? random.uniform(0.1, 1.0) : 0.0});
  }
  return joints;
}

struct ChainDynamics {
  Eigen::MatrixXd B = Eigen::MatrixXd(kJoints, kJoints), C = B;
  Eigen::VectorXd G = Eigen::VectorXd(kJoints);
};

ChainDynamics dynamics(SerialRobot& robot, const Eigen::VectorXd& xi, const Eigen::VectorXd& rate) {
  ChainDynamics out;
  robot.update(xi, rate);
  robot.dynamics(kGravity, out.B, out.C, out.G);
  return out;
}

class Chain : public ::testing::Test {
 protected:
  testing_support::RandomArm random_{21};
  std::vector<DhJoint> joints_ = odd_robot(random_);
  SerialRobot robot_{joints_};
  Eigen::VectorXd xi_ = random_.vector(kJoints, 2.0), rate_ = random_.vector(kJoints, 2.0);
};

TEST_F(Chain, FramesAreTheProductOfDenavitHartenbergMatrices) {
  robot_.update(xi_, rate_);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int j = 0; j < kJoints; ++j) {
    const DhJoint& joint = joints_[static_cast<std::size_t>(j)];
    const double theta = joint.prismatic ? joint.fixed : xi_(j);
    const double d = joint.prismatic ? xi_(j) : joint.fixed;
    T = T * Eigen::AngleAxisd(theta, Eigen::Vector3d::UnitZ()) *
        Eigen::Translation3d(joint.a, 0.0, d) *
        Eigen::AngleAxisd(std::atan2(joint.sin_alpha, joint.cos_alpha), Eigen::Vector3d::UnitX());
    EXPECT_TRUE(robot_.orientation(j + 1).isApprox(T.linear(), 1e-14)) << j;
    EXPECT_TRUE(robot_.position(j + 1).isApprox(T.translation(), 1e-14)) << j;
  }
}

TEST_F(Chain, JacobianColumnsAreThoseOfTheTextbook) {
  robot_.update(xi_, rate_);
  for (int frame = 1; frame <= kJoints; ++frame) {
    Eigen::Matrix3Xd J(3, frame), J_rate(3, frame), J_angular(3, frame);
    robot_.jacobians(frame, J, J_rate);
    robot_.angular_jacobian(frame, J_angular);
    for (int j = 0; j < frame; ++j) {
      const bool prismatic = joints_[static_cast<std::size_t>(j)].prismatic;
      const Eigen::Vector3d z = robot_.orientation(j).col(2);
      const Eigen::Vector3d arm = robot_.position(frame) - robot_.position(j);
      const Eigen::Vector3d linear = prismatic ? z : z.cross(arm);
      const Eigen::Vector3d angular = prismatic ? Eigen::Vector3d(0.0, 0.0, 0.0) : z;
      EXPECT_LE((J.col(j) - linear).norm(), 1e-14);
      EXPECT_LE((J_angular.col(j) - angular).norm(), 1e-14);
    }
  }
}

TEST_F(Chain, JacobianRateIsADirectionalDerivative) {
  constexpr double h = 1e-5;
  Eigen::Matrix3Xd J(3, kJoints), J_rate(3, kJoints), above = J, below = J, unused = J;
  robot_.update(xi_ + h * rate_, rate_);
  robot_.jacobians(kJoints, above, unused);
  robot_.update(xi_ - h * rate_, rate_);
  robot_.jacobians(kJoints, below, unused);
  robot_.update(xi_, rate_);
  robot_.jacobians(kJoints, J, J_rate);
  EXPECT_LE(((above - below) / (2.0 * h) - J_rate).cwiseAbs().maxCoeff(), 1e-8);
}

/// C_ij = 1/2 sum_k (B_ij,k + B_ik,j - B_jk,i) xi'_k, the derivatives by differences.
TEST_F(Chain, CoriolisMatrixIsMadeOfChristoffelSymbols) {
  constexpr double h = 1e-5;
  std::vector<Eigen::MatrixXd> slope;
  for (int k = 0; k < kJoints; ++k) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(kJoints);
    step(k) = h;
    slope.push_back(
        (dynamics(robot_, xi_ + step, rate_).B - dynamics(robot_, xi_ - step, rate_).B) /
        (2.0 * h));
  }
  const Eigen::MatrixXd C = dynamics(robot_, xi_, rate_).C;
  for (int i = 0; i < kJoints; ++i) {
    for (int j = 0; j < kJoints; ++j) {
      double sum = 0.0;
      for (int k = 0; k < kJoints; ++k) {
        const auto at = [&](int of) { return slope[static_cast<std::size_t>(of)]; };
        sum += 0.5 * (at(k)(i, j) + at(j)(i, k) - at(i)(j, k)) * rate_(k);
      }
      EXPECT_NEAR(C(i, j), sum, 1e-8) << i << " " << j;
    }
  }
}

TEST_F(Chain, GravityIsTheSlopeOfThePotential) {
  const auto potential = [&](const Eigen::VectorXd& xi) {
    robot_.update(xi, rate_);
    double U = 0.0;
    for (int j = 0; j < kJoints; ++j) {
      U -= joints_[static_cast<std::size_t>(j)].mass_kg * kGravity.dot(robot_.position(j + 1));
    }
    return U;
  };
  const Eigen::VectorXd G = dynamics(robot_, xi_, rate_).G;
  constexpr double h = 1e-5;
  for (int k = 0; k < kJoints; ++k) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(kJoints);
    step(k) = h;
    EXPECT_NEAR(G(k), (potential(xi_ + step) - potential(xi_ - step)) / (2.0 * h), 1e-8) << k;
  }
}

}  // namespace
}  // namespace softarm
