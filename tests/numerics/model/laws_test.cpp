// Laws that hold whatever the numbers are: B symmetric and positive definite, B-dot - 2C skew, C
// linear and symmetric in its velocities, energy changing by the power put in, and no step in
// anything where the code changes its formula.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <numbers>

#include "dev/reference_model/reference_model.hpp"
#include "model/arc_moments.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "unit/model/random_arm.hpp"

namespace softarm {
namespace {

using reference::Real;
using reference::Vector;
using testing_support::largest_rate;
using testing_support::RandomArm;
using testing_support::State;

struct Matrices {
  Eigen::MatrixXd B, C;
  Eigen::VectorXd G, force;  ///< force = B a + C(u, v) v + G by the recursion
};

Matrices evaluate(const ArmParameters& arm, const State& s) {
  const int dof = arm.dof();
  DynamicsWorkspace workspace(arm);
  Matrices m{Eigen::MatrixXd(dof, dof), Eigen::MatrixXd(dof, dof), Eigen::VectorXd(dof),
             Eigen::VectorXd(dof)};
  dynamics_matrices(arm, workspace, s.u, s.v, m.B, m.C, m.G);
  inverse_dynamics(arm, workspace, s.u, s.v, s.v, s.a, {}, m.force);
  return m;
}

class Laws : public ::testing::TestWithParam<testing_support::ArmKind> {
 protected:
  /// Arms of 1 to 64 segments, some with neighbours of very different size.
  template <class Check>
  void for_hard_arms(Check check) {
    RandomArm random(1);
    for (const int n : {1, 2, 3, 4, 5, 6, 7, 8, 13, 32, 64}) {
      for (int k = 0; k < (n < 10 ? 60 : 3); ++k) {
        const double ratio = k % 3 == 0 ? 1e6 : k % 3 == 1 ? 30.0 : 2.0;
        const ArmParameters arm = random.arm(n, GetParam(), ratio);
        State s = random.state(arm, n > 10 ? 3.0 : 7.0, k % 5 == 0 ? 1e3 : 2.0);
        if (k % 4 == 0) s.u.head<2>().setZero();
        check(arm, s, random);
        if (HasFailure()) FAIL() << n << " segments, trial " << k;
      }
    }
  }
};

TEST_P(Laws, InertiaIsSymmetricToTheBit) {
  for_hard_arms([](const ArmParameters& arm, const State& s, RandomArm&) {
    const Matrices m = evaluate(arm, s);
    EXPECT_EQ(m.B, m.B.transpose());
    DynamicsWorkspace workspace(arm);
    Eigen::MatrixXd alone(arm.dof(), arm.dof());
    inertia_matrix(arm, workspace, s.u, alone);
    EXPECT_EQ(alone, alone.transpose());
  });
}

TEST_P(Laws, InertiaIsPositiveDefinite) {
  // To the rounding of its entries, 1e-13 of the scaled diagonal: point masses of six segments have
  // a smallest scaled eigenvalue of 1e-10, of more than ten segments one below rounding.
  for_hard_arms([](const ArmParameters& arm, const State& s, RandomArm&) {
    Eigen::MatrixXd B = evaluate(arm, s).B;
    ASSERT_GT(B.diagonal().minCoeff(), 0.0);
    const Eigen::VectorXd scale = B.diagonal().cwiseSqrt().cwiseInverse();
    Eigen::MatrixXd scaled = scale.asDiagonal() * B * scale.asDiagonal();
    scaled.diagonal().array() += 1e-13 * arm.dof();
    EXPECT_EQ(Eigen::LLT<Eigen::MatrixXd>(scaled).info(), Eigen::Success);
    DynamicsWorkspace workspace(arm);
    EXPECT_GT(kinetic_energy(arm, workspace, s.u, s.v), 0.0);
  });
}

TEST_P(Laws, InertiaRateMinusTwiceCoriolisIsSkew) {
  // C + C' of the code against B-dot, a difference of the reference's B in long double.
  RandomArm random(2);
  for (int k = 0; k < 60; ++k) {
    const int n = 1 + k % 6;
    const ArmParameters arm = random.arm(n, GetParam(), k % 2 == 0 ? 1e3 : 3.0);
    const State s = random.state(arm, 7.0);
    const Vector u = s.u.cast<Real>(), v = s.v.cast<Real>();
    const Real h = 1e-4L;
    const auto B = [&](Real step) { return reference::dynamics(arm, u + step * v, v).B; };
    const reference::Matrix B_rate = (8 * (B(h) - B(-h)) - (B(2 * h) - B(-2 * h))) / (12 * h);
    const auto sizes = reference::dynamics(arm, u, v);
    const reference::Matrix C = evaluate(arm, s).C.cast<Real>();
    const reference::Matrix skew = B_rate - C - C.transpose();
    for (int i = 0; i < arm.dof(); ++i) {
      for (int j = 0; j < arm.dof(); ++j) {
        const Real speed = largest_rate(arm, u, v);
        const Real size = sizes.s(i) * (sizes.r(j) + speed * sizes.s(j)) +
                          sizes.s(j) * (sizes.r(i) + speed * sizes.s(i));
        ASSERT_LE(std::abs(skew(i, j)), 1e-12L * size) << n << " segments, trial " << k;
      }
    }
  }
}

TEST_P(Laws, CoriolisMatrixIsLinearInTheVelocity) {
  for_hard_arms([](const ArmParameters& arm, State s, RandomArm& random) {
    const Eigen::VectorXd v = s.v, w = random.state(arm, 0.0, 3.0).v;
    const auto C = [&](const Eigen::VectorXd& velocity) {
      s.v = velocity;
      return evaluate(arm, s).C;
    };
    // Powers of two are exact, so doubling must be too.
    EXPECT_EQ(C(2.0 * v), 2.0 * C(v));
    EXPECT_EQ(C(-v), -C(v));
    const auto sizes = reference::dynamics(arm, s.u.cast<Real>(), v.cast<Real>());
    const auto other = reference::dynamics(arm, s.u.cast<Real>(), w.cast<Real>());
    const Eigen::MatrixXd sum = C(v + w) - C(v) - C(w);
    const Real speed = largest_rate(arm, s.u, v) + largest_rate(arm, s.u, w);
    for (int i = 0; i < arm.dof(); ++i) {
      for (int j = 0; j < arm.dof(); ++j) {
        const Real size = sizes.s(i) * (sizes.r(j) + other.r(j) + speed * sizes.s(j));
        ASSERT_LE(std::abs(sum(i, j)), 2e-13L * (1 + arm.size() / 10) * size);
      }
    }
  });
}

TEST_P(Laws, VelocityProductIsBilinearAndSymmetric) {
  for_hard_arms([](const ArmParameters& arm, const State& s, RandomArm& random) {
    const int dof = arm.dof();
    DynamicsWorkspace workspace(arm);
    const Eigen::VectorXd w = random.state(arm, 0.0, 3.0).v, x = random.state(arm, 0.0, 3.0).v;
    const auto product = [&](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
      Eigen::VectorXd out(dof);
      inverse_dynamics(arm, workspace, s.u, a, b, s.a,
                       {.inertia = false, .coriolis = true, .gravity = false}, out);
      return out;
    };
    EXPECT_EQ(product(4.0 * s.v, w), 4.0 * product(s.v, w));
    const Eigen::VectorXd swapped = product(s.v, w) - product(w, s.v);
    const Eigen::VectorXd sum = product(s.v, w + x) - product(s.v, w) - product(s.v, x);
    const auto sizes = reference::dynamics(arm, s.u.cast<Real>(), s.v.cast<Real>());
    Real along = 0;
    const Real speed = largest_rate(arm, s.u, s.v);
    for (int j = 0; j < dof; ++j) {
      along += (sizes.r(j) + speed * sizes.s(j)) * Real(std::abs(w(j)) + std::abs(x(j)));
    }
    for (int i = 0; i < dof; ++i) {
      ASSERT_LE(std::abs(swapped(i)), 1e-13L * (1 + arm.size() / 10) * sizes.s(i) * along);
      ASSERT_LE(std::abs(sum(i)), 1e-13L * (1 + arm.size() / 10) * sizes.s(i) * along);
    }
  });
}

TEST_P(Laws, EnergyChangesByThePowerPutIn) {
  // d/dt (T + U + elastic) along forward dynamics = u' . (tau - D u'), with the energies and their
  // slopes from the reference model.
  RandomArm random(3);
  for (int k = 0; k < 60; ++k) {
    const int n = 1 + k % 6;
    const ArmParameters arm = random.arm(n, GetParam(), k % 2 == 0 ? 30.0 : 3.0);
    const State s = random.state(arm, 6.5);
    DynamicsWorkspace workspace(arm);
    Eigen::VectorXd acceleration(arm.dof());
    const Eigen::VectorXd tau = random.vector(arm.dof(), 0.5);
    ASSERT_TRUE(forward_dynamics(arm, workspace, s.u, s.v, tau, acceleration));
    const Vector u = s.u.cast<Real>(), v = s.v.cast<Real>(), a = acceleration.cast<Real>();
    const auto energy = [&](Real t) {
      const auto at = reference::dynamics(arm, u + t * v + t * t / 2 * a, v + t * a);
      const Vector q = u + t * v + t * t / 2 * a;
      const Vector elastic = reference::impedance(arm, q, Vector::Zero(arm.dof()));
      return at.kinetic_energy + at.gravity_potential + q.dot(elastic) / 2;
    };
    // A time in which no segment's shape changes by more than a few ten thousandths.
    const Real h = 3e-4L / (1 + largest_rate(arm, u, v) + std::sqrt(largest_rate(arm, u, a)));
    const Real slope = (8 * (energy(h) - energy(-h)) - (energy(2 * h) - energy(-2 * h))) / (12 * h);
    Real power = 0, size = 0;
    const auto terms = reference::dynamics(arm, u, v);
    const Vector zero = Vector::Zero(arm.dof());
    const Vector damping = reference::impedance(arm, zero, v);
    const Vector elastic = reference::impedance(arm, u, zero);
    for (int i = 0; i < arm.dof(); ++i) {
      power += v(i) * (tau(i) - damping(i));
      size += std::abs(v(i)) *
              (terms.s(i) * (terms.s.dot(a.cwiseAbs()) + terms.r.dot(v.cwiseAbs()) + terms.w) +
               std::abs(elastic(i)));
    }
    EXPECT_LE(std::abs(slope - power), 1e-10L * size) << n << " segments, trial " << k;
  }
}

TEST_P(Laws, NothingStepsWhereTheFormulaChanges) {
  RandomArm random(5);
  for (const double limit : {1.0, kArcSeriesLimit, kSeriesLimit, kHighSeriesLimit, 64.0}) {
    const ArmParameters arm = random.arm(3, GetParam());
    State below = random.state(arm, 1.0), above = below;
    // u along x: s = u_x^2 is the first double below the limit, or not below it.
    double theta = std::sqrt(limit);
    while (theta * theta >= limit) theta = std::nextafter(theta, 0.0);
    const double other = std::nextafter(theta, 100.0);
    ASSERT_GE(other * other, limit);
    for (int i = 0; i < 3; ++i) {
      const auto bend = Eigen::seqN(arm.segment_dof() * i, 2);
      const Eigen::Vector2d direction = i == 1 ? Eigen::Vector2d(0, -1) : Eigen::Vector2d(1, 0);
      below.u(bend) = theta * direction;
      above.u(bend) = other * direction;
    }
    const Matrices a = evaluate(arm, below), b = evaluate(arm, above);
    const double speed = largest_rate(arm, below.u, below.v);
    const Eigen::VectorXd s = a.B.diagonal().cwiseSqrt();
    const Eigen::MatrixXd size = s * s.transpose();
    const double unit = std::numeric_limits<double>::epsilon() * (1.0 + limit);
    EXPECT_LE((a.B - b.B).cwiseQuotient(size).cwiseAbs().maxCoeff(), 2 * unit) << limit;
    EXPECT_LE((a.C - b.C).cwiseQuotient(size).cwiseAbs().maxCoeff(), 6 * unit * speed) << limit;
    EXPECT_LE((a.G - b.G).cwiseQuotient(s).cwiseAbs().maxCoeff(), 10 * unit) << limit;
    EXPECT_LE((a.force - b.force).cwiseQuotient(s).cwiseAbs().maxCoeff(),
              4 * unit * (s.sum() * 5.0 + s.sum() * speed * speed * 3.0 + 10.0))
        << limit;
    EXPECT_LE((tip_position(arm, below.u) - tip_position(arm, above.u)).norm(), 2 * unit) << limit;
  }
}

INSTANTIATE_TEST_SUITE_P(ArmKinds, Laws, ::testing::ValuesIn(testing_support::kArmKinds),
                         [](const auto& kind) { return name(kind.param); });

}  // namespace
}  // namespace softarm
