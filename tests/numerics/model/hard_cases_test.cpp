// Special angles, extreme ratios, long arms and many random states: the recursion, the matrices and
// the laws must agree.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "unit/model/random_arm.hpp"

namespace softarm {
namespace {

using testing_support::RandomArm;
using testing_support::State;

constexpr double kPi = std::numbers::pi;

class HardCases : public ::testing::TestWithParam<MassModel> {
 protected:
  /// Point masses at their centres: B = sum mu J'J, C = sum mu J' J-dot from the kinematics of arms
  /// cut off there.
  static void expect_consistent(const ArmParameters& arm, const State& s) {
    const int dof = arm.dof();
    DynamicsWorkspace workspace(arm);
    Eigen::MatrixXd B(dof, dof), C(dof, dof);
    Eigen::VectorXd G(dof), out(dof);
    dynamics_matrices(arm, workspace, s.u, s.v, B, C, G);
    ASSERT_TRUE(B.allFinite() && C.allFinite() && G.allFinite());
    ASSERT_EQ(B, B.transpose());
    inverse_dynamics(arm, workspace, s.u, s.v, s.v, s.a, {}, out);
    const Eigen::VectorXd want = B * s.a + C * s.v + G;
    const Eigen::VectorXd root = B.diagonal().cwiseSqrt();
    // Row i is a moment that the motion of the mass by unit u_i' feels: root_i times what the
    // others bring about.
    const double speed = s.v.cwiseAbs().maxCoeff();
    const double force = root.dot(s.a.cwiseAbs()) + root.maxCoeff() * dof * speed * speed +
                         std::sqrt(total_mass(arm)) * arm.gravity_mps2.norm();
    for (int i = 0; i < dof; ++i) {
      ASSERT_NEAR(out(i), want(i), 1e-13 * root(i) * force) << "row " << i << " of " << dof;
    }
  }

  static double total_mass(const ArmParameters& arm) {
    double sum = 0.0;
    for (const auto& segment : arm.segments) sum += segment.mass_kg;
    return sum;
  }
};

TEST_P(HardCases, SpecialAngles) {
  RandomArm random(1);
  for (const double theta :
       {0.0, 5e-324, 1e-300, 1e-160, 1e-12, 1e-9, 1e-6, 1e-3, 1e-1, 0.5 * kPi, 2.0, kPi - 1e-9, kPi,
        kPi + 1e-9, std::sqrt(12.0), 1.5 * kPi, std::sqrt(33.0), 2.0 * kPi, 7.0}) {
    for (const double phi : {0.0, 0.3, kPi, -kPi, 0.5 * kPi}) {
      const ArmParameters arm = random.arm(3, GetParam());
      State s = random.state(3, 1.0, 1e3);
      for (int i = 0; i < 3; ++i) {
        s.u.segment<2>(2 * i) << theta * std::cos(phi), theta * std::sin(phi);
      }
      expect_consistent(arm, s);
    }
  }
}

TEST_P(HardCases, RandomStates) {
  RandomArm random(2);
  for (int i = 0; i < 20000; ++i) {
    const int n = 1 + i % 6;
    expect_consistent(random.arm(n, GetParam()), random.state(n, 7.0));
    if (HasFatalFailure()) return;
  }
}

TEST_P(HardCases, LongArmsAndExtremeRatios) {
  RandomArm random(3);
  for (const int n : {1, 2, 5, 10, 20, 40, 64}) {
    for (const double ratio : {1.0, 1e3, 1e6}) {
      for (int i = 0; i < 10; ++i) {
        expect_consistent(random.arm(n, GetParam(), ratio), random.state(n, 3.0));
        if (HasFatalFailure()) return;
      }
    }
  }
}

TEST_P(HardCases, InertiaIsPositiveDefinite) {
  RandomArm random(4);
  for (int i = 0; i < 2000; ++i) {
    const int n = 1 + i % 4;
    const ArmParameters arm = random.arm(n, GetParam());
    DynamicsWorkspace workspace(arm);
    const State s = random.state(n, 3.0);
    Eigen::MatrixXd B(2 * n, 2 * n);
    inertia_matrix(arm, workspace, s.u, B);
    const Eigen::VectorXd scale = B.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * B * scale.asDiagonal();
    EXPECT_EQ(scaled.llt().info(), Eigen::Success);
    EXPECT_GT(kinetic_energy(arm, workspace, s.u, s.v), 0.0);
  }
}

TEST_P(HardCases, ContinuousAcrossEverySwitch) {
  RandomArm random(5);
  for (const double s : {4.0, 12.0, 33.0}) {
    const ArmParameters arm = random.arm(2, GetParam());
    DynamicsWorkspace workspace(arm);
    State state = random.state(2, 1.0);
    Eigen::MatrixXd B[2] = {Eigen::MatrixXd(4, 4), Eigen::MatrixXd(4, 4)}, C[2] = {B[0], B[1]};
    Eigen::VectorXd G(4);
    for (int side = 0; side < 2; ++side) {
      // u along x, so that s = u_x^2 falls on either side of the switch.
      const double theta = std::sqrt(s) * (1.0 + (side == 0 ? -4e-16 : 4e-16));
      state.u << theta, 0.0, -theta, 0.0;
      dynamics_matrices(arm, workspace, state.u, state.v, B[side], C[side], G);
    }
    EXPECT_LE((B[0] - B[1]).cwiseAbs().maxCoeff(), 2e-14 * B[0].cwiseAbs().maxCoeff()) << s;
    EXPECT_LE((C[0] - C[1]).cwiseAbs().maxCoeff(), 4e-14 * B[0].cwiseAbs().maxCoeff()) << s;
  }
}

INSTANTIATE_TEST_SUITE_P(MassModels, HardCases,
                         ::testing::Values(MassModel::point, MassModel::distributed),
                         [](const auto& mass) {
                           return mass.param == MassModel::point ? "point" : "distributed";
                         });

TEST(PointMass, IsTheSumOverItsCentres) {
  RandomArm random(6);
  for (int trial = 0; trial < 300; ++trial) {
    const int n = 1 + trial % 5;
    const ArmParameters arm = random.arm(n, MassModel::point, trial % 2 == 0 ? 3.0 : 1e4);
    const State s = random.state(n, 7.0);
    DynamicsWorkspace workspace(arm);
    const int dof = 2 * n;
    Eigen::MatrixXd B(dof, dof), C(dof, dof), slope(dof, dof);
    Eigen::VectorXd G(dof);
    dynamics_matrices(arm, workspace, s.u, s.v, B, C, G);
    // J of every centre by Richardson-extrapolated central differences of its position.
    Eigen::MatrixXd want = Eigen::MatrixXd::Zero(dof, dof);
    std::vector<Eigen::Matrix3Xd> J(static_cast<std::size_t>(n), Eigen::Matrix3Xd(3, dof));
    const auto centres = [&](int k, double step) {
      Eigen::Matrix3Xd at(3, n);
      mass_centres(arm, s.u + step * Eigen::VectorXd::Unit(dof, k), at);
      return at;
    };
    for (int k = 0; k < dof; ++k) {
      constexpr double kStep = 2e-3;
      const auto difference = [&](double h) -> Eigen::Matrix3Xd {
        return (centres(k, h) - centres(k, -h)) / (2 * h);
      };
      const Eigen::Matrix3Xd a = difference(kStep), b = difference(2 * kStep),
                             c = difference(4 * kStep);
      const Eigen::Matrix3Xd ab = (4 * a - b) / 3, bc = (4 * b - c) / 3;
      const Eigen::Matrix3Xd best = (16 * ab - bc) / 15;
      for (int m = 0; m < n; ++m) J[static_cast<std::size_t>(m)].col(k) = best.col(m);
    }
    for (int m = 0; m < n; ++m) {
      const auto& Jm = J[static_cast<std::size_t>(m)];
      want += arm.segments[static_cast<std::size_t>(m)].mass_kg * Jm.transpose() * Jm;
    }
    EXPECT_LE((B - want).cwiseAbs().maxCoeff(), 1e-10 * want.cwiseAbs().maxCoeff());
  }
}

}  // namespace
}  // namespace softarm
