// The exact derivatives against differences of the reference model in 80-bit numbers, and laws that
// hold whatever the arm.
#include "softarm/model/derivatives.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "dev/reference_model/reference_model.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/statics.hpp"
#include "unit/model/random_arm.hpp"

namespace softarm {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using reference::Matrix;
using reference::Real;
using reference::Vector;
using testing_support::kArmKinds;
using testing_support::RandomArm;
using testing_support::State;

/// d f / d x by central differences, extrapolated to an error of h^6: about 1e-15 of the slope.
Matrix slope(const std::function<Vector(const Vector&)>& f, const Vector& x,
             const std::function<Real(int)>& step) {
  Matrix out(f(x).size(), x.size());
  for (int j = 0; j < x.size(); ++j) {
    const auto difference = [&](Real h) -> Vector {
      Vector above = x, below = x;
      above(j) += h;
      below(j) -= h;
      return (f(above) - f(below)) / (2 * h);
    };
    const Real h = step(j);
    out.col(j) = (difference(4 * h) - 20 * difference(2 * h) + 64 * difference(h)) / 45;
  }
  return out;
}

/// Of rows as their largest entry, and of a column as the unit of its coordinate.
void expect_close(const MatrixXd& got, const Matrix& want, const char* what) {
  for (int i = 0; i < want.rows(); ++i) {
    const Real size = want.row(i).cwiseAbs().maxCoeff();
    for (int j = 0; j < want.cols(); ++j) {
      EXPECT_LE(std::abs(got(i, j) - want(i, j)), 1e-10L * size) << what << " " << i << " " << j;
    }
  }
}

class Derivatives : public ::testing::TestWithParam<int> {
 protected:
  Derivatives() : random_(static_cast<unsigned>(GetParam() + 1)) {
    const int kind = GetParam() % 5;
    arm_ = kind < 4 ? random_.arm(3, kArmKinds[static_cast<std::size_t>(kind)])
                    : random_.thick(random_.arm(3, MassModel::distributed));
    state_ = random_.state(arm_, theta());
  }
  /// Both sides of the limits of series: sqrt(4), sqrt(12), sqrt(33).
  double theta() const { return GetParam() < 5 ? 1.5 : GetParam() < 10 ? 4.0 : 6.0; }
  Real step(int j) const { return j % arm_.segment_dof() == 2 ? 1e-4L : 2e-3L; }
  std::function<Real(int)> steps() const {
    return [this](int j) { return step(j); };
  }
  Vector inverse(const Vector& u, const Vector& v, const Vector& a) const {
    return reference::inverse_dynamics(reference::dynamics(arm_, u, v), v, a) +
           reference::impedance(arm_, u, v);
  }
  Vector forward(const Vector& u, const Vector& v, const Vector& force) const {
    return reference::forward_dynamics(arm_, reference::dynamics(arm_, u, v), u, v, force);
  }

  RandomArm random_;
  ArmParameters arm_;
  State state_;
};

TEST_P(Derivatives, OfInverseDynamics) {
  const Vector u = state_.u.cast<Real>(), v = state_.v.cast<Real>(), a = state_.a.cast<Real>();
  MatrixXd got(arm_.dof(), arm_.dof());
  ModelDerivatives(arm_).inverse_dynamics_by_u(state_.u, state_.v, state_.a, got);
  expect_close(got, slope([&](const Vector& x) { return inverse(x, v, a); }, u, steps()), "by u");
}

TEST_P(Derivatives, OfForwardDynamics) {
  const int dof = arm_.dof();
  const VectorXd force = 0.1 * state_.a;
  const Vector u = state_.u.cast<Real>(), v = state_.v.cast<Real>(), f = force.cast<Real>();
  MatrixXd by_u(dof, dof), by_velocity(dof, dof), by_force(dof, dof);
  VectorXd acceleration(dof), alone(dof);
  ModelDerivatives derivatives(arm_);
  ASSERT_TRUE(derivatives.forward_dynamics(state_.u, state_.v, force, acceleration, by_u,
                                           by_velocity, by_force));
  DynamicsWorkspace workspace(arm_);
  ASSERT_TRUE(forward_dynamics(arm_, workspace, state_.u, state_.v, force, alone));
  EXPECT_LT((acceleration - alone).norm(), 1e-11 * alone.norm());
  expect_close(by_u, slope([&](const Vector& x) { return forward(x, v, f); }, u, steps()), "by u");
  expect_close(by_velocity, slope([&](const Vector& x) { return forward(u, x, f); }, v, steps()),
               "by velocity");
  expect_close(by_force, slope([&](const Vector& x) { return forward(u, v, x); }, f, steps()),
               "by force");
}

TEST_P(Derivatives, OfStatics) {
  const Vector u = state_.u.cast<Real>(), still = Vector::Zero(arm_.dof());
  MatrixXd got(arm_.dof(), arm_.dof());
  ModelDerivatives(arm_).static_stiffness(state_.u, got);
  const auto moments = [&](const Vector& x) {
    return Vector(reference::dynamics(arm_, x, still).G + reference::impedance(arm_, x, still));
  };
  expect_close(got, slope(moments, u, steps()), "stiffness");
  EXPECT_LT((got - got.transpose()).norm(), 1e-13 * got.norm()) << "a potential has one Hessian";
}

INSTANTIATE_TEST_SUITE_P(Arms, Derivatives, ::testing::Range(0, 15));

TEST(Derivatives, OfOneSegmentAndOfMoreThanFour) {
  RandomArm random(3);
  for (const int n : {1, 6}) {
    const ArmParameters arm = random.arm(n, MassModel::distributed);
    const State state = random.state(n, 1.2);
    const Vector v = state.v.cast<Real>(), a = state.a.cast<Real>();
    MatrixXd got(2 * n, 2 * n);
    ModelDerivatives(arm).inverse_dynamics_by_u(state.u, state.v, state.a, got);
    const auto inverse = [&](const Vector& x) {
      return Vector(reference::inverse_dynamics(reference::dynamics(arm, x, v), v, a) +
                    reference::impedance(arm, x, v));
    };
    expect_close(got, slope(inverse, state.u.cast<Real>(), [](int) { return 2e-3L; }), "by u");
  }
}

TEST(Derivatives, LengthsThatAreHeldDoNotMove) {
  RandomArm random(5);
  ArmParameters arm = random.arm(2, {MassModel::distributed, true});
  arm.segments[0].constant_length = true;
  State state = random.state(arm, 1.0);
  state.v(2) = 0.0;
  MatrixXd by_u(6, 6), by_velocity(6, 6), by_force(6, 6);
  VectorXd acceleration(6), above(6), below(6);
  ASSERT_TRUE(ModelDerivatives(arm).forward_dynamics(state.u, state.v, 0.1 * state.a, acceleration,
                                                     by_u, by_velocity, by_force));
  for (const MatrixXd* slope : {&by_u, &by_velocity, &by_force}) EXPECT_EQ(slope->row(2).norm(), 0);
  EXPECT_EQ(by_force.col(2).norm(), 0);
  DynamicsWorkspace workspace(arm);
  for (int j = 0; j < 6; ++j) {
    const VectorXd step = 1e-6 * VectorXd::Unit(6, j);
    forward_dynamics(arm, workspace, state.u + step, state.v, 0.1 * state.a, above);
    forward_dynamics(arm, workspace, state.u - step, state.v, 0.1 * state.a, below);
    EXPECT_LT(((above - below) / 2e-6 - by_u.col(j)).norm(), 1e-6 * by_u.norm());
  }
}

TEST(Derivatives, OfActuation) {
  RandomArm random(9);
  ArmParameters arm = random.arm(3, MassModel::point);
  MatrixXd got(6, 6);
  VectorXd above(6), below(6);
  const VectorXd u = random.bending(3, 2.5), tau = random.vector(6, 1.0);
  actuation_slope(arm, u, tau, got);
  EXPECT_EQ(got.norm(), 0.0) << "moments on the cross-sections do not depend on u";
  arm.actuation = ActuationModel::couple;
  actuation_slope(arm, u, tau, got);
  for (int j = 0; j < 6; ++j) {
    const VectorXd step = 1e-5 * VectorXd::Unit(6, j);
    apply_actuation(arm, u + step, tau, above);
    apply_actuation(arm, u - step, tau, below);
    EXPECT_LT(((above - below) / 2e-5 - got.col(j)).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace softarm
