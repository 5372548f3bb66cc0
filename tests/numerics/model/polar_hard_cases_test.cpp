// The polar route on hard cases: the chain rule in long double, theta of either sign and near 0,
// phi at and across +-pi.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dev/reference_model/reference_model.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/polar.hpp"
#include "unit/model/random_arm.hpp"

namespace softarm {
namespace {

using reference::Real;
using reference::Vector;
using testing_support::RandomArm;

using std::numbers::pi;
constexpr Real kUlp = 2.22e-16L;

struct PolarState {
  Eigen::VectorXd q, qd;
};

class PolarHardCases : public ::testing::TestWithParam<MassModel> {
 protected:
  /// B, C and G in polar against P'BP, P'(B P-dot + C P), P'G of the reference, relative to the
  /// sizes that follow the same rule, so that phi rows count relative to theta and theta^2.
  static void expect_chain_rule(const ArmParameters& arm, const PolarState& s, double theta) {
    const int dof = arm.dof();
    DynamicsWorkspace workspace(arm);
    Eigen::VectorXd u(dof), v(dof), G(dof);
    Eigen::MatrixXd B(dof, dof), C(dof, dof);
    polar_dynamics_matrices(arm, workspace, s.q, s.qd, B, C, G);
    expect_equal(arm, s, theta, B, C, G);
    polar_to_u(s.q, u);
    polar_velocity_to_u(s.q, s.qd, v);
    dynamics_matrices(arm, workspace, u, v, B, C, G);
    dynamics_to_polar(s.q, s.qd, B, C, G);
    expect_equal(arm, s, theta, B, C, G);
  }

  static void expect_equal(const ArmParameters& arm, const PolarState& s, double theta,
                           const Eigen::MatrixXd& B, const Eigen::MatrixXd& C,
                           const Eigen::VectorXd& G) {
    const int dof = arm.dof();
    const Vector q = s.q.cast<Real>(), qd = s.qd.cast<Real>();
    const Vector u = reference::polar_to_u(q), v = reference::polar_velocity_to_u(q, qd);
    const auto want = reference::to_polar(reference::dynamics(arm, u, v), q, qd);
    const Real speed = v.cwiseAbs().maxCoeff();
    const Real bound = kUlp * 32 * (1 + Real(theta) * Real(theta)) * (1 + arm.size() / Real(10));
    for (int i = 0; i < dof; ++i) {
      ASSERT_LE(std::abs(G(i) - want.G(i)), bound * want.s(i) * want.w + 1e-322L) << "G " << i;
      for (int j = 0; j < dof; ++j) {
        const Real size = want.s(i) * want.s(j);
        ASSERT_LE(std::abs(B(i, j) - want.B(i, j)), bound * size + 1e-322L) << i << ", " << j;
        const Real rate = want.r(j) + want.s(j) * speed;
        ASSERT_LE(std::abs(C(i, j) - want.C(i, j)), bound * want.s(i) * rate + 1e-322L)
            << i << ", " << j;
      }
    }
  }

  PolarState state(RandomArm& random, int n, double theta, double phi, double speed) {
    PolarState s{Eigen::VectorXd(2 * n), random.vector(2 * n, speed)};
    for (int i = 0; i < n; ++i) s.q.segment<2>(2 * i) << phi, theta;
    return s;
  }
};

TEST_P(PolarHardCases, ChainRuleHoldsAtSpecialAngles) {
  RandomArm random(1);
  const ArmParameters arm = random.arm(3, GetParam());
  for (const double theta : {0.0, 1e-300, 1e-160, 1e-12, 1e-8, 1e-4, 1e-2, 0.5, 0.5 * pi,
                             std::sqrt(12.0), pi - 1e-9, pi, pi + 1e-9, 1.5 * pi, 2.0 * pi, 7.0}) {
    for (const double phi : {0.0, 0.4, 0.5 * pi, pi, -pi, std::nextafter(pi, 4.0), 3.5, -7.0}) {
      for (const double sign : {1.0, -1.0}) {
        const double speed = phi == 0.4 ? 1e3 : 2.0;
        expect_chain_rule(arm, state(random, 3, sign * theta, phi, speed), theta);
        if (HasFatalFailure()) FAIL() << "theta " << sign * theta << ", phi " << phi;
      }
    }
  }
}

TEST_P(PolarHardCases, ChainRuleHoldsForRandomStates) {
  RandomArm random(2);
  for (int k = 0; k < 3000; ++k) {
    const int n = 1 + k % 6;
    const ArmParameters arm = random.arm(n, GetParam(), k % 4 == 0 ? 100.0 : 3.0);
    PolarState s{Eigen::VectorXd(2 * n), random.vector(2 * n, 3.0)};
    for (int i = 0; i < n; ++i) {
      s.q.segment<2>(2 * i) << random.uniform(-7.0, 7.0), random.uniform(-7.0, 7.0);
    }
    expect_chain_rule(arm, s, 7.0);
    if (HasFatalFailure()) FAIL() << "state " << k;
  }
}

TEST_P(PolarHardCases, ImpedanceIsThatOfThePaper) {
  // (14): K = diag(0, k), D = beta diag(theta^2, 1), from k I and beta I in u.
  RandomArm random(3);
  for (const double theta : {0.0, 1e-160, 1e-8, 0.3, pi, 7.0, -0.3, -1e-8, -7.0}) {
    for (const double phi : {0.0, 1.0, pi, -pi, 3.3}) {
      const ArmParameters arm = random.arm(2, GetParam());
      const PolarState s = state(random, 2, theta, phi, 2.0);
      Eigen::VectorXd u(4), v(4), force = Eigen::VectorXd::Zero(4), zero = force;
      polar_to_u(s.q, u);
      polar_velocity_to_u(s.q, s.qd, v);
      for (const bool elastic : {true, false}) {
        force.setZero();
        add_impedance(arm, elastic ? u : zero, elastic ? zero : v, force);
        force_to_polar(s.q, force, force);
        for (int i = 0; i < 2; ++i) {
          const auto& segment = arm.segments[static_cast<std::size_t>(i)];
          const double k = segment.stiffness_nm_per_rad, beta = segment.damping_nms_per_rad;
          const double phi_d = s.qd(2 * i), theta_d = s.qd(2 * i + 1), size = std::abs(theta);
          const double want_phi = elastic ? 0.0 : beta * theta * theta * phi_d;
          const double want_theta = elastic ? k * theta : beta * theta_d;
          const double scale =
              elastic ? k * size : beta * (size * std::abs(phi_d) + std::abs(theta_d));
          EXPECT_NEAR(force(2 * i), want_phi, 1e-15 * size * scale + 1e-322);
          EXPECT_NEAR(force(2 * i + 1), want_theta, 1e-15 * scale + 1e-322);
        }
      }
    }
  }
}

TEST_P(PolarHardCases, BothSignsOfThetaAreTheSameArm) {
  // (phi, theta) and (phi + pi, -theta) are one u; B of q differs in the sign of mixed entries.
  RandomArm random(4);
  for (int k = 0; k < 200; ++k) {
    const ArmParameters arm = random.arm(2, GetParam());
    PolarState a{Eigen::VectorXd(4), random.vector(4, 2.0)}, b = a;
    for (int i = 0; i < 2; ++i) {
      a.q.segment<2>(2 * i) << random.uniform(-3.0, 3.0), random.uniform(0.1, 6.0);
      b.q.segment<2>(2 * i) << a.q(2 * i) + pi, -a.q(2 * i + 1);
      b.qd.segment<2>(2 * i) << a.qd(2 * i), -a.qd(2 * i + 1);
    }
    Eigen::VectorXd u(4), v(4), w(4);
    polar_to_u(a.q, u);
    polar_to_u(b.q, w);
    EXPECT_LE((u - w).cwiseAbs().maxCoeff(), 1e-14);
    polar_velocity_to_u(a.q, a.qd, v);
    polar_velocity_to_u(b.q, b.qd, w);
    EXPECT_LE((v - w).cwiseAbs().maxCoeff(), 6e-14);
  }
}

TEST_P(PolarHardCases, ThereAndBack) {
  for (const double theta : {5e-324, 1e-310, 1e-300, 1e-160, 1e-12, 1e-3, 1.0, pi, 7.0, 1e8}) {
    for (const double phi : {0.0, 0.7, 0.5 * pi, 3.0, std::nextafter(pi, 0.0), pi, -pi, -3.0}) {
      const Eigen::Vector2d q(phi, theta), qd(0.3, -0.7);
      Eigen::VectorXd u(2), back(2), v(2), rate(2);
      polar_to_u(q, u);
      u_to_polar(u, back);
      const double loss = theta < 1e-300 ? 1.0 : 4e-16;  // a denormal has one or two digits
      EXPECT_NEAR(back(1), theta, loss * theta);
      EXPECT_LE(std::abs(std::remainder(back(0) - phi, 2.0 * pi)), 2 * loss);
      EXPECT_LE(std::abs(back(0)), pi);
      if (theta < 1e-300) continue;
      polar_velocity_to_u(q, qd, v);
      u_velocity_to_polar(q, v, rate);
      EXPECT_NEAR(rate(1), qd(1), 1e-15 * (1.0 + theta));
      EXPECT_NEAR(rate(0), qd(0), 1e-15 * (1.0 + 1.0 / theta));
    }
  }
}

TEST_P(PolarHardCases, PhiCrossesPiWithoutAStepInU) {
  for (const double theta : {1e-12, 0.4, 3.0}) {
    Eigen::VectorXd before(2), after(2), q(2);
    polar_to_u(Eigen::Vector2d(pi, theta), before);
    polar_to_u(Eigen::Vector2d(-pi, theta), after);
    EXPECT_LE((before - after).norm(), 3e-16 * theta);
    u_to_polar(Eigen::Vector2d(-theta, 1e-9 * theta), q);
    EXPECT_NEAR(q(0), pi - 1e-9, 1e-15);
    u_to_polar(Eigen::Vector2d(-theta, -1e-9 * theta), q);
    EXPECT_NEAR(q(0), -pi + 1e-9, 1e-15);
  }
}

INSTANTIATE_TEST_SUITE_P(MassModels, PolarHardCases,
                         ::testing::Values(MassModel::point, MassModel::distributed),
                         [](const auto& mass) {
                           return mass.param == MassModel::point ? "point" : "distributed";
                         });

}  // namespace
}  // namespace softarm
