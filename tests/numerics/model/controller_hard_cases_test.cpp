// The controller (17) and the solver of (16) on hard cases against the reference model.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dev/reference_model/reference_model.hpp"
#include "softarm/control/curvature_controller.hpp"
#include "softarm/model/dynamics.hpp"
#include "unit/model/random_arm.hpp"

namespace softarm {
namespace {

using reference::Real;
using reference::Vector;
using testing_support::RandomArm;
using testing_support::State;

using std::numbers::pi;

class ControllerHardCases : public ::testing::TestWithParam<MassModel> {};

/// tau = G + C u'_ref + B u''_ref + K u_ref + K_P (u_ref - u) + D u'_ref + K_D (u'_ref - u'), in
/// long double, and the sum of the magnitudes that it adds up.
void expect_law(const ArmParameters& arm, RandomArm& random, const State& s, double theta) {
  const int dof = arm.dof();
  ControllerSettings settings;
  for (int i = 0; i < dof; ++i) {
    settings.kp.push_back(random.uniform(0.0, 2.0));
    settings.kd.push_back(random.uniform(0.0, 0.1));
  }
  CurvatureController controller(arm, settings);
  ReferenceWindow window;
  window.now.u = SegmentVector(random.vector(dof, 3.0));
  window.now.velocity = SegmentVector(random.vector(dof, 5.0));
  window.now.acceleration = SegmentVector(random.vector(dof, 20.0));
  ControlOutput out;
  controller.compute(s.u, s.v, window, out);

  const Vector u = s.u.cast<Real>(), v = s.v.cast<Real>();
  const Vector u_ref = window.now.u.cast<Real>(), v_ref = window.now.velocity.cast<Real>(),
               a_ref = window.now.acceleration.cast<Real>();
  const auto terms = reference::dynamics(arm, u, v);
  Vector want =
      reference::inverse_dynamics(terms, v_ref, a_ref) + reference::impedance(arm, u_ref, v_ref);
  Vector size = reference::inverse_dynamics_scale(terms, v_ref, a_ref) +
                reference::impedance(arm, u_ref.cwiseAbs(), v_ref.cwiseAbs());
  const Real speed = v.cwiseAbs().maxCoeff() * v_ref.cwiseAbs().dot(terms.s);
  for (int i = 0; i < dof; ++i) {
    const Real kp = settings.kp[static_cast<std::size_t>(i)],
               kd = settings.kd[static_cast<std::size_t>(i)];
    want(i) += kp * (u_ref(i) - u(i)) + kd * (v_ref(i) - v(i));
    size(i) += kp * (std::abs(u_ref(i)) + std::abs(u(i))) +
               kd * (std::abs(v_ref(i)) + std::abs(v(i))) + terms.s(i) * speed;
    const Real bound =
        4 * 2.22e-16L * (1 + Real(theta) * Real(theta)) * (1 + arm.size() / Real(10));
    ASSERT_LE(std::abs(out.tau_u_nm[i] - want(i)), bound * size(i)) << "row " << i;
    // A of `chamber` only exchanges the two.
    const Eigen::Index other = i % 2 == 0 ? i + 1 : i - 1;
    ASSERT_EQ(std::abs(out.tau_actuation_nm[i]), std::abs(out.tau_u_nm[other]));
  }
}

TEST_P(ControllerHardCases, GivesTheLawAtSpecialAngles) {
  RandomArm random(1);
  for (const double theta :
       {0.0, 5e-324, 1e-300, 1e-160, 1e-12, 1e-8, 1e-4, 0.1, 0.5 * pi, 2.0, pi - 1e-9, pi,
        pi + 1e-9, std::sqrt(12.0), 1.5 * pi, std::sqrt(33.0), 2.0 * pi, 7.0}) {
    for (const double phi : {0.0, 0.3, pi, -pi, 2.0}) {
      const ArmParameters arm = random.arm(3, GetParam());
      State s = random.state(3, 1.0, phi == 0.3 ? 1e3 : 2.0);
      for (int i = 0; i < 3; ++i) {
        s.u.segment<2>(2 * i) << theta * std::cos(phi), theta * std::sin(phi);
      }
      expect_law(arm, random, s, theta);
      if (HasFatalFailure()) FAIL() << "theta " << theta << ", phi " << phi;
    }
  }
}

TEST_P(ControllerHardCases, GivesTheLawForLongAndUnequalArms) {
  RandomArm random(2);
  for (const int n : {1, 2, 3, 5, 6, 10, 24, 64}) {
    for (int k = 0; k < (n < 10 ? 100 : 3); ++k) {
      const double theta = n > 10 ? 3.0 : 7.0;
      expect_law(random.arm(n, GetParam(), k % 2 == 0 ? 1e6 : 3.0), random, random.state(n, theta),
                 theta);
      if (HasFatalFailure()) FAIL() << n << " segments, trial " << k;
    }
  }
}

TEST_P(ControllerHardCases, SolverLeavesNoResidualWhateverTheCondition) {
  // B x = rhs with point masses at rest and straight, n = 6: condition 6.7e9. Cholesky leaves a
  // residual of rounding size against |B| |x|; the error of x itself may be that times the
  // condition.
  RandomArm random(3);
  for (const int n : {1, 2, 3, 4, 5, 6}) {
    for (const double theta : {0.0, 1e-8, 0.4, 1.5, 3.0}) {
      ArmParameters arm;
      arm.mass = GetParam();
      arm.segments.resize(static_cast<std::size_t>(n));
      DynamicsWorkspace workspace(arm);
      const int dof = 2 * n;
      const Eigen::VectorXd u = random.bending(n, theta);
      Eigen::MatrixXd B(dof, dof);
      inertia_matrix(arm, workspace, u, B);
      Eigen::VectorXd rhs = random.vector(dof, 1.0), x(dof);
      ASSERT_TRUE(solve_inertia(workspace, B, rhs, x)) << n << ", theta " << theta;
      const reference::Matrix exact = B.cast<Real>();
      const Vector residual = exact * x.cast<Real>() - rhs.cast<Real>();
      const Vector size =
          exact.cwiseAbs() * x.cast<Real>().cwiseAbs() + rhs.cast<Real>().cwiseAbs();
      EXPECT_LE(residual.cwiseQuotient(size).cwiseAbs().maxCoeff(), 4e-16L * n)
          << n << ", theta " << theta;

      // And all of (16): u'' against the reference's own solution, times the condition.
      const Eigen::VectorXd v = random.vector(dof, 1.0);
      Eigen::VectorXd acceleration(dof);
      ASSERT_TRUE(forward_dynamics(arm, workspace, u, v, rhs, acceleration));
      const auto terms = reference::dynamics(arm, u.cast<Real>(), v.cast<Real>());
      const Vector want =
          reference::forward_dynamics(arm, terms, u.cast<Real>(), v.cast<Real>(), rhs.cast<Real>());
      const Real error = (acceleration.cast<Real>() - want).cwiseProduct(terms.s).norm();
      const Real condition = std::pow(14.0L, 2 * n - 1);  // of the straight arm, and more
      EXPECT_LE(error,
                1e-15L * std::min(condition, Real(1e11)) * want.cwiseProduct(terms.s).norm());
    }
  }
}

INSTANTIATE_TEST_SUITE_P(MassModels, ControllerHardCases,
                         ::testing::Values(MassModel::point, MassModel::distributed),
                         [](const auto& mass) {
                           return mass.param == MassModel::point ? "point" : "distributed";
                         });

}  // namespace
}  // namespace softarm
