// Statics against the golden numbers, the potential energy, and limits that are known by hand.
#include "softarm/model/statics.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "golden.hpp"
#include "random_arm.hpp"
#include "softarm/model/actuation_matrix.hpp"

namespace softarm {
namespace {

using testing_support::RandomArm;

/// Of gravity and springs, J.
double potential_j(const ArmParameters& arm, const Eigen::VectorXd& u) {
  double energy = gravity_potential(arm, u);
  for (Eigen::Index i = 0; i < arm.size(); ++i)
    energy += 0.5 * arm.segments[static_cast<std::size_t>(i)].stiffness_nm_per_rad *
              u.segment<2>(2 * i).squaredNorm();
  return energy;
}

TEST(Statics, MomentsAreTheGoldenOnes) {
  int compared = 0;
  for (const golden::Case& c : golden::cases()) {
    if (c.polar) continue;
    DynamicsWorkspace workspace(c.arm);
    Eigen::VectorXd gravity(c.arm.dof()), all(c.arm.dof());
    gravity_moments(c.arm, workspace, c.q, gravity);
    static_moments(c.arm, workspace, c.q, all);
    EXPECT_LE(golden::error_over_tolerance(c, c.expected, "G", gravity), 0.05) << c.id;
    const Eigen::VectorXd want = c.expected.at("K") * c.q + c.expected.at("G");
    EXPECT_LT((all - want).norm(), 1e-13 * (1.0 + want.norm())) << c.id;
    ++compared;
  }
  EXPECT_GT(compared, 10);
}

TEST(Statics, MomentsAndSlopeAreDerivativesOfThePotential) {
  RandomArm random(7);
  for (const MassModel mass : {MassModel::point, MassModel::distributed}) {
    const ArmParameters arm = random.arm(3, mass);
    const Eigen::VectorXd u = random.bending(3, 2.0);
    DynamicsWorkspace workspace(arm);
    Eigen::VectorXd moments(6), above(6), below(6);
    static_moments(arm, workspace, u, moments);
    Eigen::MatrixXd slope = gravity_slope(arm, u);
    EXPECT_LT((slope - slope.transpose()).norm(), 1e-7 * slope.norm());
    for (Eigen::Index j = 0; j < 6; ++j) {
      const Eigen::VectorXd step = 1e-5 * Eigen::VectorXd::Unit(6, j);
      EXPECT_NEAR((potential_j(arm, u + step) - potential_j(arm, u - step)) / 2e-5, moments[j],
                  1e-8);
      static_moments(arm, workspace, u + step, above);
      static_moments(arm, workspace, u - step, below);
      slope(j, j) += arm.segments[static_cast<std::size_t>(j / 2)].stiffness_nm_per_rad;
      EXPECT_LT(((above - below) / 2e-5 - slope.col(j)).norm(), 1e-7);
    }
  }
}

TEST(Statics, TheRestShapeIsTheOneWhoseMomentsWereGiven) {
  RandomArm random(11);
  for (const ActuationModel actuation : {ActuationModel::chamber, ActuationModel::couple}) {
    for (int trial = 0; trial < 20; ++trial) {
      ArmParameters arm = random.arm(3, MassModel::distributed);
      arm.actuation = actuation;
      // So stiff that there is one shape near straight.
      for (SegmentParameters& segment : arm.segments) segment.stiffness_nm_per_rad += 2.0;
      const Eigen::VectorXd u = random.bending(3, 0.6);
      DynamicsWorkspace workspace(arm);
      Eigen::VectorXd moments(6), tau(6);
      static_moments(arm, workspace, u, moments);
      solve_actuation(arm, u, moments, tau);
      const auto found = rest_shape(arm, tau);
      ASSERT_TRUE(found.has_value());
      EXPECT_LT((*found - u).norm(), 1e-10);
    }
  }
}

TEST(Statics, AWeightlessArmBendsByMomentOverStiffness) {
  RandomArm random(3);
  ArmParameters arm = random.arm(4, MassModel::point);
  arm.gravity_mps2.setZero();
  const Eigen::VectorXd tau = random.vector(8, 0.5);
  const auto u = rest_shape(arm, tau);
  ASSERT_TRUE(u.has_value());
  for (Eigen::Index i = 0; i < 4; ++i) {
    const double k = arm.segments[static_cast<std::size_t>(i)].stiffness_nm_per_rad;
    const Eigen::Vector2d want(tau[2 * i + 1] / k, -tau[2 * i] / k);  // A of `chamber`
    EXPECT_LT((u->segment<2>(2 * i) - want).norm(), 1e-12);
  }
}

TEST(Statics, NothingBalancesWithoutSprings) {
  RandomArm random(5);
  ArmParameters arm = random.arm(2, MassModel::distributed);
  arm.gravity_mps2.setZero();
  for (SegmentParameters& segment : arm.segments) segment.stiffness_nm_per_rad = 0.0;
  EXPECT_FALSE(rest_shape(arm, Eigen::VectorXd::Constant(4, 0.1)).has_value());
}

}  // namespace
}  // namespace softarm
