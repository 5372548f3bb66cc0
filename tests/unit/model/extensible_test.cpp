// Segments that stretch: with e held they are those of constant length, and the laws of e.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "golden.hpp"
#include "random_arm.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/augmented_robot.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/entire_functions.hpp"
#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

using testing_support::RandomArm;
using testing_support::State;

/// Every term of the model at one state.
struct Terms {
  std::vector<Eigen::Isometry3d> ends;
  Eigen::Matrix3Xd centres, J, J_rate, J_angular;
  Eigen::MatrixXd B, C, A;
  Eigen::VectorXd G, Cv, bias, tip_force, impedance;  ///< bias = B a + C(u, b) v + G
  double kinetic_energy = 0.0, gravity_potential = 0.0;

  Terms(const ArmParameters& arm, const State& s, const Eigen::VectorXd& b)
      : ends(arm.segments.size()),
        centres(3, arm.size()),
        J(3, arm.dof()),
        J_rate(3, arm.dof()),
        J_angular(3, arm.dof()),
        B(arm.dof(), arm.dof()),
        C(B),
        A(B),
        G(arm.dof()),
        Cv(arm.dof()),
        bias(arm.dof()),
        tip_force(Eigen::VectorXd::Zero(arm.dof())),
        impedance(tip_force) {
    DynamicsWorkspace workspace(arm);
    forward_kinematics(arm, s.u, ends);
    mass_centres(arm, s.u, centres);
    tip_jacobians(arm, s.u, s.v, J, J_rate);
    tip_angular_jacobian(arm, s.u, J_angular);
    dynamics_matrices(arm, workspace, s.u, s.v, B, C, G);
    inverse_dynamics(arm, workspace, s.u, s.v, s.v, s.a,
                     {.inertia = false, .coriolis = true, .gravity = false}, Cv);
    inverse_dynamics(arm, workspace, s.u, b, s.v, s.a, {}, bias);
    kinetic_energy = softarm::kinetic_energy(arm, workspace, s.u, s.v);
    gravity_potential = softarm::gravity_potential(arm, s.u);
    add_tip_force(arm, s.u, {0.3, -0.2, 0.5}, tip_force);
    add_impedance(arm, s.u, s.v, impedance);
    for (int j = 0; j < arm.dof(); ++j) {
      Eigen::VectorXd column(arm.dof());
      apply_actuation(arm, s.u, Eigen::VectorXd::Unit(arm.dof(), j), column);
      A.col(j) = column;
    }
  }
};

/// Rows or columns of u among [u_x, u_y, e].
std::vector<int> bending(int segments) {
  std::vector<int> result;
  for (int i = 0; i < segments; ++i) {
    result.push_back(3 * i);
    result.push_back(3 * i + 1);
  }
  return result;
}

/// [u, e] of every segment.
Eigen::VectorXd with_elongation(const Eigen::VectorXd& u, const Eigen::VectorXd& e) {
  Eigen::VectorXd result(3 * e.size());
  for (Eigen::Index i = 0; i < e.size(); ++i) {
    result.segment<3>(3 * i) << u(2 * i), u(2 * i + 1), e(i);
  }
  return result;
}

/// The arm of constant length L + e in u, and the arm that stretches at (u, e) with e' = 0.
void expect_reduction(const ArmParameters& held, const State& s, const Eigen::VectorXd& b,
                      const Eigen::VectorXd& e) {
  const int n = held.size();
  ArmParameters stretching = held;
  stretching.extensible = true;
  for (int i = 0; i < n; ++i) stretching.segments[static_cast<std::size_t>(i)].length_m -= e(i);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(n);
  const State wide{with_elongation(s.u, e), with_elongation(s.v, zero), with_elongation(s.a, zero)};
  const Terms want(held, s, b), got(stretching, wide, with_elongation(b, zero));
  const std::vector<int> u = bending(n);

  // l = L + e is one rounding, and each term is a few more.
  const double unit = (8.0 + 2.0 * n) * std::numeric_limits<double>::epsilon();
  double length = held.base_position_m.norm();
  for (const auto& segment : held.segments) length += segment.length_m;
  const double speed = s.v.cwiseAbs().maxCoeff() + std::numeric_limits<double>::min();
  const auto largest = [](const auto& m) { return m.cwiseAbs().maxCoeff(); };
  for (std::size_t i = 0; i < want.ends.size(); ++i) {
    EXPECT_LE(largest((got.ends[i].matrix() - want.ends[i].matrix()).eval()), unit * (1 + length));
  }
  EXPECT_LE(largest((got.centres - want.centres).eval()), unit * length);
  EXPECT_LE(largest((got.J(Eigen::all, u) - want.J).eval()), unit * length);
  EXPECT_LE(largest((got.J_rate(Eigen::all, u) - want.J_rate).eval()), unit * n * length * speed);
  EXPECT_LE(largest((got.J_angular(Eigen::all, u) - want.J_angular).eval()), unit);
  EXPECT_EQ(got.A(u, u), want.A);

  const Eigen::VectorXd size = want.B.diagonal().cwiseSqrt();
  const double all = size.maxCoeff();
  EXPECT_LE(largest((got.B(u, u) - want.B).cwiseQuotient(size * size.transpose()).eval()),
            32 * unit);
  EXPECT_LE(largest((got.C(u, u) - want.C).eval()), 4 * unit * all * all * speed);
  double mass = 0.0;
  for (const auto& segment : held.segments) mass += segment.mass_kg;
  const double weight = std::sqrt(mass) * held.gravity_mps2.norm();
  EXPECT_LE(largest((got.G(u) - want.G).eval()), unit * all * weight);
  const double coriolis = all * speed * all * s.v.cwiseAbs().sum();
  EXPECT_LE(largest((got.Cv(u) - want.Cv).eval()), unit * coriolis);
  EXPECT_LE(largest((got.bias(u) - want.bias).eval()),
            unit * (all * all * b.cwiseAbs().maxCoeff() * s.v.cwiseAbs().sum() + all * weight +
                    all * all * s.a.cwiseAbs().sum()));
  EXPECT_LE(largest((got.tip_force(u) - want.tip_force).eval()), unit * length);
  EXPECT_EQ(got.impedance(u), want.impedance);
  EXPECT_NEAR(got.kinetic_energy, want.kinetic_energy,
              unit * std::pow(size.dot(s.v.cwiseAbs()), 2));
  EXPECT_NEAR(got.gravity_potential, want.gravity_potential,
              unit * mass * held.gravity_mps2.norm() * length);
}

class Reduction : public ::testing::TestWithParam<MassModel> {};

TEST_P(Reduction, RandomStatesWithElongationHeld) {
  RandomArm random(1);
  for (int k = 0; k < 400; ++k) {
    const int n = 1 + k % 7;
    ArmParameters held = random.arm(n, GetParam());
    if (k % 5 == 0 && GetParam() == MassModel::distributed) held = random.thick(held);
    Eigen::VectorXd e(n);
    for (int i = 0; i < n; ++i) {
      const double length = held.segments[static_cast<std::size_t>(i)].length_m;
      const double strain = random.uniform(-0.3, 0.5);  // e = strain L of L + e
      e(i) = k % 3 == 0 ? 0.0 : length * strain / (1.0 + strain);
    }
    expect_reduction(held, random.state(n, k % 2 == 0 ? 6.3 : 1.6), random.vector(2 * n, 2.0), e);
    if (HasFailure()) FAIL() << n << " segments, state " << k;
  }
}

TEST_P(Reduction, GoldenCasesInU) {
  RandomArm random(2);
  int cases = 0;
  for (const golden::Case& c : golden::cases()) {
    if (c.polar) continue;
    ++cases;
    ArmParameters held = c.arm;
    held.mass = GetParam();
    const int n = held.size();
    for (const double part : {0.0, 0.3}) {
      Eigen::VectorXd e(n);
      for (int i = 0; i < n; ++i) e(i) = part * held.segments[static_cast<std::size_t>(i)].length_m;
      expect_reduction(held, {c.q, c.qd, random.vector(2 * n, 5.0)}, random.vector(2 * n, 2.0), e);
      if (HasFailure()) FAIL() << c.id << ", part " << part;
    }
  }
  EXPECT_GT(cases, 3);
}

TEST_P(Reduction, AccelerationAgreesUnderTheForceThatHoldsTheLength) {
  RandomArm random(3);
  for (int k = 0; k < 50; ++k) {
    const int n = 1 + k % 3;
    const ArmParameters arm = random.arm(n, {GetParam(), true});
    State s = random.state(arm, 3.0);
    ArmParameters held = arm;
    held.extensible = false;
    const std::vector<int> u = bending(n);
    for (int i = 0; i < n; ++i) {
      s.v(3 * i + 2) = 0.0;
      held.segments[static_cast<std::size_t>(i)].length_m += s.u(3 * i + 2);
    }
    const Eigen::VectorXd bend = s.u(u), velocity = s.v(u), torque = random.vector(2 * n, 0.5);
    Eigen::VectorXd want(2 * n);
    DynamicsWorkspace narrow(held);
    ASSERT_TRUE(forward_dynamics(held, narrow, bend, velocity, torque, want));
    // What holds e: the e rows of the inverse dynamics of that very motion.
    Eigen::VectorXd acceleration = with_elongation(want, Eigen::VectorXd::Zero(n));
    Eigen::VectorXd force(3 * n), got(3 * n);
    DynamicsWorkspace workspace(arm);
    inverse_dynamics(arm, workspace, s.u, s.v, s.v, acceleration, {}, force);
    add_impedance(arm, s.u, s.v, force);
    force(u) = torque;
    ASSERT_TRUE(forward_dynamics(arm, workspace, s.u, s.v, force, got));
    EXPECT_LE((got - acceleration).cwiseAbs().maxCoeff(), 1e-8 * want.cwiseAbs().maxCoeff());
  }
}

TEST_P(Reduction, ElongationAloneHasNoCoriolisForce) {
  // Second derivatives of any point by two elongations vanish, between segments too.
  RandomArm random(4);
  for (int k = 0; k < 100; ++k) {
    const int n = 1 + k % 6;
    const ArmParameters arm = random.arm(n, {GetParam(), true});
    State s = random.state(arm, 6.0);
    for (const int j : bending(n)) s.v(j) = 0.0;
    const Terms got(arm, s, s.v);
    EXPECT_EQ(got.Cv, Eigen::VectorXd::Zero(3 * n));
    const Eigen::VectorXd size = got.B.diagonal().cwiseSqrt();
    EXPECT_LE((got.C * s.v).cwiseQuotient(size).cwiseAbs().maxCoeff(),
              1e-14 * testing_support::largest_rate(arm, s.u, s.v) * size.dot(s.v.cwiseAbs()));
  }
}

TEST_P(Reduction, OneSegmentScalesWithItsLength) {
  RandomArm random(5);
  for (int k = 0; k < 50; ++k) {
    const ArmParameters arm = random.arm(1, {GetParam(), true});
    const State s = random.state(arm, 6.0);
    const double l = arm.segments[0].length_m + s.u(2), strain_rate = s.v(2) / l;
    const Terms got(arm, s, s.v);

    // B = diag(l, l, 1) B of length 1 diag(l, l, 1).
    State unit = s;
    unit.u(2) = 1.0 - arm.segments[0].length_m;
    const Eigen::Vector3d scale(l, l, 1.0);
    const Eigen::Matrix3d B = scale.asDiagonal() * Terms(arm, unit, s.v).B * scale.asDiagonal();
    const Eigen::Vector3d size = B.diagonal().cwiseSqrt();
    EXPECT_LE((got.B - B).cwiseQuotient(size * size.transpose()).cwiseAbs().maxCoeff(), 1e-14);

    // C_uu = C_uu at constant length + (e'/l) B_uu, C_ue = B_uu u' / l.
    State held = s;
    held.v(2) = 0.0;
    const Eigen::Matrix2d C_uu = Terms(arm, held, s.v).C.topLeftCorner<2, 2>();
    const Eigen::Matrix2d B_uu = got.B.topLeftCorner<2, 2>();
    const double bound = 1e-13 * B_uu.norm() * testing_support::largest_rate(arm, s.u, s.v);
    EXPECT_LE((got.C.topLeftCorner<2, 2>() - C_uu - strain_rate * B_uu).norm(), bound);
    EXPECT_LE((got.C.topRightCorner<2, 1>() - B_uu * s.v.head<2>() / l).norm(), bound / l);
  }
}

INSTANTIATE_TEST_SUITE_P(MassModels, Reduction,
                         ::testing::Values(MassModel::point, MassModel::distributed),
                         [](const auto& mass) {
                           return mass.param == MassModel::point ? "point" : "distributed";
                         });

TEST(Extensible, PointMassesAreAsSingularAsTheirOwnColumns) {
  // det B = prod mu^3 det(own columns)^2, det = l^2 c3(s) c1(s/4) (c2 - c3)(s/4) / 4.
  RandomArm random(6);
  for (int k = 0; k < 60; ++k) {
    const int n = 1 + k % 3;
    const ArmParameters arm = random.arm(n, {MassModel::point, true});
    const State s = random.state(arm, 5.0);
    double want = 1.0;
    for (int i = 0; i < n; ++i) {
      const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
      const double square = s.u.segment<2>(3 * i).squaredNorm();
      const double l = segment.length_m + s.u(3 * i + 2);
      const auto c = entire_functions(square), half = entire_functions(square / 4);
      const double own = l * l * c[3] * half[1] * (half[2] - half[3]) / 4;
      want *= std::pow(segment.mass_kg, 3) * own * own;
    }
    const Terms got(arm, s, s.v);
    EXPECT_NEAR(got.B.determinant() / want, 1.0, 1e-7) << n << " segments, state " << k;
    if (n == 1) {
      const double square = s.u.head<2>().squaredNorm();
      const double l = arm.segments[0].length_m + s.u(2), c2 = entire_functions(square)[2];
      EXPECT_NEAR(std::abs(got.J.determinant()), l * l * c2 * c2, 1e-14 * l * l);
    }
  }
}

TEST(Extensible, SegmentsOfConstantLengthKeepIt) {
  // Taking e out of the equations is taking its row and column out.
  RandomArm random(9);
  for (const MassModel mass : {MassModel::point, MassModel::distributed}) {
    for (int k = 0; k < 40; ++k) {
      const int n = 1 + k % 4;
      ArmParameters arm = random.arm(n, {mass, true});
      State s = random.state(arm, 2.0);
      std::vector<int> kept;
      for (int i = 0; i < n; ++i) {
        SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
        segment.constant_length = random.uniform(0.0, 1.0) < 0.5;
        if (segment.constant_length) s.u(3 * i + 2) = s.v(3 * i + 2) = 0.0;
        for (int c = 0; c < (segment.constant_length ? 2 : 3); ++c) kept.push_back(3 * i + c);
      }
      const Eigen::VectorXd force = random.vector(3 * n, 0.5);
      DynamicsWorkspace workspace(arm);
      Eigen::VectorXd got(3 * n), bias(3 * n), want(kept.size());
      ASSERT_TRUE(forward_dynamics(arm, workspace, s.u, s.v, force, got));
      Eigen::MatrixXd B(3 * n, 3 * n), C(3 * n, 3 * n);
      dynamics_matrices(arm, workspace, s.u, s.v, B, C, bias);
      bias += C * s.v;
      add_impedance(arm, s.u, s.v, bias);
      want = B(kept, kept).ldlt().solve((force - bias)(kept));
      EXPECT_LE((got(kept) - want).cwiseAbs().maxCoeff(), 1e-8 * want.cwiseAbs().maxCoeff());
      for (int i = 0; i < n; ++i) {
        if (arm.segments[static_cast<std::size_t>(i)].constant_length) {
          EXPECT_EQ(got(3 * i + 2), 0.0);
        }
      }
    }
  }
}

TEST(Extensible, WhatHasNoFormIsRefused) {
  RandomArm random(7);
  ArmParameters arm = random.arm(2, {MassModel::point, true});
  EXPECT_THROW(AugmentedRobot{arm}, std::invalid_argument);
  const State s = random.state(arm, 1.0);
  DynamicsWorkspace workspace(arm);
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(6, 6), C = B;
  Eigen::VectorXd G = Eigen::VectorXd::Zero(6);
  polar_dynamics_matrices(arm, workspace, s.u, s.v, B, C, G);
  EXPECT_TRUE(B.array().isNaN().all() && C.array().isNaN().all() && G.array().isNaN().all());
  arm.actuation = ActuationModel::couple;
  Eigen::VectorXd out = Eigen::VectorXd::Zero(6);
  apply_actuation(arm, s.u, s.a, out);
  EXPECT_TRUE(std::isnan(out(2)) && std::isnan(out(5)));
  out.setZero();
  solve_actuation(arm, s.u, s.a, out);
  EXPECT_TRUE(std::isnan(out(2)) && std::isnan(out(5)));
}

TEST(Extensible, ActuationIsInverted) {
  RandomArm random(8);
  const ArmParameters arm = random.arm(3, {MassModel::point, true});
  const Eigen::VectorXd u = random.state(arm, 3.0).u, tau = random.vector(9, 2.0);
  Eigen::VectorXd force(9), back(9);
  apply_actuation(arm, u, tau, force);
  EXPECT_EQ(force.segment<3>(3), Eigen::Vector3d(tau(4), -tau(3), tau(5)));
  solve_actuation(arm, u, force, back);
  EXPECT_EQ(back, tau);
}

}  // namespace
}  // namespace softarm
