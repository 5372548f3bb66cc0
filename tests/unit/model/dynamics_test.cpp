// Dynamics against the laws it must obey: energy, Lagrange's equations by finite differences,
// symmetry, skewness.
#include "softarm/model/dynamics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "random_arm.hpp"
#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

using testing_support::RandomArm;
using testing_support::State;

struct Matrices {
  Eigen::MatrixXd B, C;
  Eigen::VectorXd G;
};

Matrices matrices(const ArmParameters& arm, DynamicsWorkspace& workspace, const Eigen::VectorXd& u,
                  const Eigen::VectorXd& v) {
  const int dof = arm.dof();
  Matrices m{Eigen::MatrixXd(dof, dof), Eigen::MatrixXd(dof, dof), Eigen::VectorXd(dof)};
  dynamics_matrices(arm, workspace, u, v, m.B, m.C, m.G);
  return m;
}

class Dynamics : public ::testing::TestWithParam<testing_support::ArmKind> {};

TEST_P(Dynamics, CoriolisMatrixIsChristoffelOfTheInertia) {
  RandomArm random(3);
  for (const int n : {1, 2, 4}) {
    const ArmParameters arm = random.arm(n, GetParam());
    DynamicsWorkspace workspace(arm);
    const State s = random.state(arm, 4.5);
    const int dof = arm.dof();
    constexpr double kStep = 1e-5;
    std::vector<Eigen::MatrixXd> slope;  // dB / du_k
    for (int k = 0; k < dof; ++k) {
      const Eigen::VectorXd e = Eigen::VectorXd::Unit(dof, k);
      slope.push_back((matrices(arm, workspace, s.u + kStep * e, s.v).B -
                       matrices(arm, workspace, s.u - kStep * e, s.v).B) /
                      (2 * kStep));
    }
    const Matrices m = matrices(arm, workspace, s.u, s.v);
    const Eigen::VectorXd size = testing_support::sizes_by_unit(arm, m.B);
    const double rate = testing_support::largest_rate(arm, s.u, s.v);
    for (int i = 0; i < dof; ++i) {
      for (int j = 0; j < dof; ++j) {
        double christoffel = 0.0;
        for (int k = 0; k < dof; ++k) {
          christoffel +=
              0.5 *
              (slope[static_cast<std::size_t>(k)](i, j) + slope[static_cast<std::size_t>(j)](i, k) -
               slope[static_cast<std::size_t>(i)](j, k)) *
              s.v(k);
        }
        EXPECT_NEAR(m.C(i, j), christoffel, 1e-7 * size(i) * size(j) * rate);
      }
    }
  }
}

TEST_P(Dynamics, InertiaRateMinusTwiceCoriolisIsSkew) {
  RandomArm random(4);
  for (const int n : {1, 3, 10}) {
    const ArmParameters arm = random.arm(n, GetParam());
    DynamicsWorkspace workspace(arm);
    const State s = random.state(arm, 6.0);
    constexpr double kStep = 1e-6;
    const Eigen::MatrixXd rate = (matrices(arm, workspace, s.u + kStep * s.v, s.v).B -
                                  matrices(arm, workspace, s.u - kStep * s.v, s.v).B) /
                                 (2 * kStep);
    const Matrices m = matrices(arm, workspace, s.u, s.v);
    const Eigen::VectorXd size = testing_support::sizes_by_unit(arm, m.B);
    const Eigen::MatrixXd error = (rate - m.C - m.C.transpose()).cwiseAbs();
    EXPECT_LE(error.cwiseQuotient(size * size.transpose()).maxCoeff(),
              1e-6 * testing_support::largest_rate(arm, s.u, s.v));
  }
}

TEST_P(Dynamics, GravityIsTheSlopeOfItsPotential) {
  RandomArm random(5);
  const ArmParameters arm = random.arm(5, GetParam());
  DynamicsWorkspace workspace(arm);
  const State s = random.state(arm, 5.0);
  const Eigen::VectorXd G = matrices(arm, workspace, s.u, s.v).G;
  constexpr double kStep = 1e-6;
  for (int k = 0; k < arm.dof(); ++k) {
    const Eigen::VectorXd e = kStep * Eigen::VectorXd::Unit(arm.dof(), k);
    const double slope =
        (gravity_potential(arm, s.u + e) - gravity_potential(arm, s.u - e)) / (2 * kStep);
    EXPECT_NEAR(G(k), slope, 1e-8);
  }
}

TEST_P(Dynamics, RecursionAgreesWithMatrices) {
  RandomArm random(6);
  for (const int n : {1, 2, 3, 7, 20, 64}) {
    const ArmParameters arm = random.arm(n, GetParam());
    DynamicsWorkspace workspace(arm);
    const State s = random.state(arm, n > 10 ? 0.6 : 6.5);
    const Eigen::VectorXd b = random.state(arm, 0.0, 3.0).v;
    const Matrices m = matrices(arm, workspace, s.u, s.v);
    EXPECT_EQ(m.B, m.B.transpose());
    const Eigen::VectorXd unit = testing_support::sizes_by_unit(arm, m.B);
    Eigen::VectorXd out(arm.dof());
    for (int mask = 0; mask < 8; ++mask) {
      const DynamicsTerms terms{(mask & 1) != 0, (mask & 2) != 0, (mask & 4) != 0};
      inverse_dynamics(arm, workspace, s.u, s.v, b, s.a, terms, out);
      Eigen::VectorXd want = Eigen::VectorXd::Zero(arm.dof());
      Eigen::VectorXd size = want;
      if (terms.inertia) {
        want += m.B * s.a;
        size += m.B.cwiseAbs() * s.a.cwiseAbs();
      }
      if (terms.coriolis) {
        want += m.C * b;
        size += m.C.cwiseAbs() * b.cwiseAbs();
      }
      if (terms.gravity) {
        want += m.G;
        size += m.G.cwiseAbs();
      }
      EXPECT_LE((out - want).cwiseQuotient(unit).cwiseAbs().maxCoeff(),
                1e-13 * n * size.cwiseQuotient(unit).maxCoeff())
          << n << " segments, terms " << mask;
    }
    // The product is symmetric in its two velocities.
    Eigen::VectorXd swapped(arm.dof());
    inverse_dynamics(arm, workspace, s.u, s.v, b, s.a, {}, out);
    inverse_dynamics(arm, workspace, s.u, b, s.v, s.a, {}, swapped);
    EXPECT_LE((out - swapped).cwiseQuotient(unit).cwiseAbs().maxCoeff(),
              1e-12 * out.cwiseQuotient(unit).cwiseAbs().maxCoeff());
  }
}

TEST_P(Dynamics, EnergiesAndForwardDynamicsFit) {
  RandomArm random(7);
  const ArmParameters arm = random.arm(3, GetParam());
  DynamicsWorkspace workspace(arm);
  const State s = random.state(arm, 3.0);
  const Matrices m = matrices(arm, workspace, s.u, s.v);
  EXPECT_NEAR(kinetic_energy(arm, workspace, s.u, s.v), 0.5 * s.v.dot(m.B * s.v),
              1e-13 * s.v.dot(m.B * s.v));
  const Eigen::Vector3d force(0.3, -0.2, 0.5);
  Eigen::VectorXd input = random.vector(arm.dof(), 0.4), acceleration(arm.dof());
  add_tip_force(arm, s.u, force, input);
  ASSERT_TRUE(forward_dynamics(arm, workspace, s.u, s.v, input, acceleration));
  Eigen::VectorXd residual = m.B * acceleration + m.C * s.v + m.G;
  add_impedance(arm, s.u, s.v, residual);
  EXPECT_LT((residual - input).cwiseAbs().maxCoeff(),
            1e-12 * (m.B.cwiseAbs() * acceleration.cwiseAbs()).maxCoeff());
  // d/dt (T + U + K u^2 / 2) = v . input - v . D v
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(arm.dof());
  Eigen::VectorXd damping = zero, stiffness = zero;
  add_impedance(arm, zero, s.v, damping);
  add_impedance(arm, s.u, zero, stiffness);
  const double power = s.v.dot(input - damping), spring = s.v.dot(stiffness);
  constexpr double kStep = 1e-7;
  const auto energy = [&](double t) {
    return kinetic_energy(arm, workspace, s.u + t * s.v + 0.5 * t * t * acceleration,
                          s.v + t * acceleration) +
           gravity_potential(arm, s.u + t * s.v + 0.5 * t * t * acceleration);
  };
  const double slope =
      (8 * (energy(kStep) - energy(-kStep)) - (energy(2 * kStep) - energy(-2 * kStep))) /
      (12 * kStep);
  const double rate = slope + spring;
  EXPECT_NEAR(rate, power, 1e-5 * (std::abs(power) + std::abs(spring) + 1.0));
}

TEST_P(Dynamics, NotANumberComesThrough) {
  RandomArm random(8);
  const ArmParameters arm = random.arm(3, GetParam());
  DynamicsWorkspace workspace(arm);
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    State s = random.state(arm, 2.0);
    s.u(2) = bad;
    Eigen::VectorXd out(arm.dof());
    inverse_dynamics(arm, workspace, s.u, s.v, s.v, s.a, {}, out);
    EXPECT_TRUE(out.hasNaN());
    EXPECT_TRUE(matrices(arm, workspace, s.u, s.v).B.hasNaN());
    EXPECT_FALSE(forward_dynamics(arm, workspace, s.u, s.v, s.a, out));
    EXPECT_TRUE(out.array().isNaN().all());
  }
}

INSTANTIATE_TEST_SUITE_P(ArmKinds, Dynamics, ::testing::ValuesIn(testing_support::kArmKinds),
                         [](const auto& kind) { return name(kind.param); });

TEST(DynamicsTipForce, IsTheTransposedJacobian) {
  RandomArm random(9);
  const ArmParameters arm = random.arm(4, MassModel::point);
  const Eigen::VectorXd u = random.bending(4, 3.0);
  const Eigen::Vector3d force(1.0, 2.0, -3.0);
  Eigen::Matrix3Xd J(3, 8);
  tip_jacobian(arm, u, J);
  Eigen::VectorXd got = Eigen::VectorXd::Zero(8);
  add_tip_force(arm, u, force, got);
  EXPECT_TRUE(got.isApprox(J.transpose() * force, 1e-14));
}

TEST(DynamicsWorkspaceTest, RefusesAnArmWithoutSegments) {
  EXPECT_THROW(DynamicsWorkspace(ArmParameters{}), std::invalid_argument);
}

}  // namespace
}  // namespace softarm
