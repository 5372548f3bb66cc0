// The controller on an integrated arm: the error follows (18), its energy never grows, lags are
// inverted.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "softarm/control/reference.hpp"
#include "unit/control/arms.hpp"

namespace softarm {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr double kStep = 2e-4;  ///< s; the fastest mode of three segments decays with 1.5e3 1/s

/// u' and u'' of an arm under an actuation torque.
VectorXd rate_of(const ArmParameters& arm, DynamicsWorkspace& workspace, const VectorXd& state,
                 const VectorXd& tau_actuation) {
  const int dof = arm.dof();
  const VectorXd u = state.head(dof), velocity = state.tail(dof);
  VectorXd force(dof), acceleration(dof), rate(2 * dof);
  apply_actuation(arm, u, tau_actuation, force);
  forward_dynamics(arm, workspace, u, velocity, force, acceleration);
  rate << velocity, acceleration;
  return rate;
}

TEST(ClosedLoop, ErrorFollows18IntegratedApart) {
  const int n = 3, dof = 6;
  const ArmParameters arm = test::paper_arm(n);
  const ControllerSettings settings = test::gains(n, 1.0, 0.01);
  CurvatureController controller(arm, settings);
  DynamicsWorkspace workspace(arm);
  ReferenceSettings reference_settings;
  PaperReference smooth;
  smooth.rise_s = 10.0;  // no jump of u'' on the way, which would cost the integrator its order
  reference_settings.phases.push_back({smooth, 0.0});
  ControllerSettings quick = settings;
  quick.blend_s = 0.3;
  Reference reference(reference_settings, quick, n);
  reference.start(0.0, VectorXd::Zero(dof), VectorXd::Zero(dof));

  VectorXd arm_state(2 * dof), error_state(2 * dof);
  arm_state << VectorXd::Constant(dof, 0.3), VectorXd::Constant(dof, -0.5);
  ReferenceWindow window;
  reference.window(0.0, 0.0, window);
  error_state << window.now.u - arm_state.head(dof), window.now.velocity - arm_state.tail(dof);
  const auto arm_rate = [&](double t, const VectorXd& state) {
    ControlOutput out;
    reference.window(t, 0.0, window);
    controller.compute(state.head(dof), state.tail(dof), window, out);
    return rate_of(arm, workspace, state, out.tau_actuation_nm);
  };
  // B e'' + C e' = -(K + K_P) e - (D + K_D) e', with B and C at u = u_ref - e: no controller, no G.
  MatrixXd B(dof, dof), C(dof, dof);
  VectorXd G(dof);
  const auto error_rate = [&](double t, const VectorXd& state) {
    ReferenceSample sample;
    reference.sample(t, sample);
    const VectorXd e = state.head(dof), ed = state.tail(dof);
    dynamics_matrices(arm, workspace, sample.u - e, sample.velocity - ed, B, C, G);
    VectorXd rate(2 * dof);
    rate << ed, B.ldlt().solve(-C * ed - (0.626 + 1.0) * e - (0.029 + 0.01) * ed);
    return rate;
  };
  double largest = 0.0;
  for (int i = 0; i < 10000; ++i) {
    test::runge_kutta(arm_rate, i * kStep, kStep, arm_state);
    test::runge_kutta(error_rate, i * kStep, kStep, error_state);
    reference.window((i + 1) * kStep, 0.0, window);
    const VectorXd error = window.now.u - arm_state.head(dof);
    largest = std::max(largest, (error - error_state.head(dof)).lpNorm<Eigen::Infinity>());
  }
  EXPECT_LT(largest, 1e-8);
  EXPECT_LT(error_state.head(dof).norm(), 0.05);  // and it dies out
}

TEST(ClosedLoop, EnergyOfTheErrorNeverGrows) {
  test::Random random(1);
  for (int trial = 0; trial < 6; ++trial) {
    const int n = 1 + trial % 3, dof = 2 * n;
    ArmParameters arm = test::random_arm(n, random);
    if (n == 1) arm.mass = MassModel::point;
    CurvatureController controller(arm, test::gains(n, 0.8, 0.005));
    DynamicsWorkspace workspace(arm);
    const VectorXd goal = random.vector(dof, 1.0), zero = VectorXd::Zero(dof);
    const ReferenceWindow window = test::at(goal, zero, zero);
    VectorXd state(2 * dof);
    state << random.vector(dof, 1.5), random.vector(dof, 5.0);
    const auto rate = [&](double, const VectorXd& s) {
      ControlOutput out;
      controller.compute(s.head(dof), s.tail(dof), window, out);
      return rate_of(arm, workspace, s, out.tau_actuation_nm);
    };
    const auto energy = [&](const VectorXd& s) {
      const VectorXd e = goal - s.head(dof);
      double elastic = 0.0;
      for (int i = 0; i < dof; ++i) {
        elastic += 0.5 *
                   (arm.segments[static_cast<std::size_t>(i / 2)].stiffness_nm_per_rad + 0.8) *
                   e[i] * e[i];
      }
      return kinetic_energy(arm, workspace, s.head(dof), s.tail(dof)) + elastic;
    };
    double before = energy(state);
    const double first = before;
    for (int i = 0; i < 8000; ++i) {
      test::runge_kutta(rate, 0.0, kStep, state);
      const double now = energy(state);
      EXPECT_LE(now, before + 1e-10 * first) << "trial " << trial << " step " << i;
      before = now;
    }
    EXPECT_LT(before, 0.01 * first);
  }
}

/// Sampled control at 1 kHz on the nominal arm; root mean square of u_ref - u from one second on.
double track(const ControllerSettings& settings, double duration_s, double from_s,
             const VectorXd& start) {
  const int n = 3, dof = 6, steps = 5;
  const ArmParameters arm = test::paper_arm(n);
  CurvatureController controller(arm, settings);
  DynamicsWorkspace workspace(arm);
  ReferenceSettings reference_settings;
  reference_settings.phases.push_back({PaperReference{}, 0.0});
  Reference reference(reference_settings, settings, n);
  VectorXd state(2 * dof);
  state << start, VectorXd::Zero(dof);
  reference.start(0.0, state.head(dof), state.tail(dof));
  ReferenceWindow window;
  ControlOutput out;
  double sum = 0.0;
  int count = 0;
  for (int tick = 0; tick < static_cast<int>(1000.0 * duration_s); ++tick) {
    const double t = 1e-3 * tick;
    reference.window(t + 0.5e-3, 0.0, window);
    // The state at the middle of the period, as far as one derivative predicts it.
    const VectorXd ahead = state.head(dof) + 0.5e-3 * state.tail(dof);
    controller.compute(ahead, state.tail(dof), window, out);
    const VectorXd tau = out.tau_actuation_nm;
    const auto rate = [&](double, const VectorXd& s) { return rate_of(arm, workspace, s, tau); };
    for (int i = 0; i < steps; ++i) test::runge_kutta(rate, 0.0, 1e-3 / steps, state);
    reference.window(t + 1e-3, 0.0, window);
    if (t >= from_s) {
      sum += (window.now.u - state.head(dof)).squaredNorm();
      count += dof;
    }
  }
  return std::sqrt(sum / count);
}

TEST(ClosedLoop, TracksThePapersReferenceOnTheNominalArm) {
  EXPECT_LT(track(test::gains(3, 1.0, 0.002), 4.0, 1.0, VectorXd::Zero(6)), 2e-4);
  EXPECT_LT(track(test::gains(3, 1.0, 0.002), 4.0, 2.0, VectorXd::Constant(6, 0.5)), 2e-4);
}

TEST(ClosedLoop, TracksItInPolarCoordinatesWithThePapersGains) {
  ControllerSettings settings = test::gains(3, 0.0, 0.0);
  settings.coordinates = ControlCoordinates::polar;
  settings.kp = {1.2, 0.0, 1.1, 0.0, 1.0, 0.0};
  settings.kd = {0.002, 0.0, 0.002, 0.0, 0.002, 0.0};
  EXPECT_LT(track(settings, 12.0, 10.0, VectorXd::Zero(6)), 2e-4);
}

TEST(ClosedLoop, PassesThroughTheStraightPoseAndBeyondARightAngle) {
  // theta = 0 is crossed at full speed between way points; phi jumps by pi there; theta reaches 1.9
  // rad.
  const int n = 2, dof = 4;
  const ArmParameters arm = test::paper_arm(n);
  ControllerSettings settings = test::gains(n, 1.0, 0.002);
  settings.blend_s = 0.2;
  CurvatureController controller(arm, settings);
  DynamicsWorkspace workspace(arm);
  ReferenceSettings phases;
  WayPointReference way;
  way.points = {{0.0, {0.0, 0.0, 0.0, 0.0}},
                {1.0, {1.9, 0.0, 0.5, 0.5}},
                {2.0, {-1.9, 0.0, -0.5, -0.5}},
                {3.0, {0.0, 1.0, -1.0, 0.01}},
                {4.0, {0.0, -1.0, -1.0, -0.01}}};
  phases.phases.push_back({way, 0.0});
  Reference reference(phases, settings, n);
  VectorXd state = VectorXd::Zero(2 * dof);
  reference.start(0.0, state.head(dof), state.tail(dof));
  ReferenceWindow window;
  double largest = 0.0;
  const auto rate = [&](double t, const VectorXd& s) {
    ControlOutput out;
    reference.window(t, 0.0, window);
    controller.compute(s.head(dof), s.tail(dof), window, out);
    EXPECT_FALSE(out.bounded);
    return rate_of(arm, workspace, s, out.tau_actuation_nm);
  };
  for (int i = 0; i < 20000; ++i) {
    test::runge_kutta(rate, i * kStep, kStep, state);
    reference.window((i + 1) * kStep, 0.0, window);
    largest = std::max(largest, (window.now.u - state.head(dof)).lpNorm<Eigen::Infinity>());
  }
  EXPECT_LT(largest, 1e-8);
}

TEST(ClosedLoop, TheLagInverseUndoesAFirstOrderLag) {
  // Command through tau_v x' = command - x, against the command without lag: an error of second
  // order is left.
  const int n = 3, dof = 6;
  const ArmParameters arm = test::paper_arm(n);
  ControllerSettings plain = test::gains(n, 0.0, 0.0), lagged = plain;
  lagged.valve_lag_s = 0.02;
  CurvatureController direct(arm, plain), inverse(arm, lagged);
  EXPECT_EQ(direct.lookahead_s(), 0.0);
  EXPECT_GT(inverse.lookahead_s(), 0.0);
  ReferenceSettings phases;
  phases.phases.push_back({PaperReference{}, 0.0});
  Reference reference(phases, lagged, n);
  reference.start(0.0, VectorXd::Zero(dof), VectorXd::Zero(dof));
  ReferenceWindow window;
  ControlOutput wanted, command;
  VectorXd behind_inverse = VectorXd::Zero(dof), behind_plain = VectorXd::Zero(dof);
  double error_inverse = 0.0, error_plain = 0.0, spike = 0.0;
  const double dt = 1e-4;
  for (int i = 0; i < 40000; ++i) {
    const double t = i * dt;
    reference.window(t, inverse.lookahead_s(), window);
    // On the reference: what is left of (17) is the part that depends on the reference alone.
    direct.compute(window.now.u, window.now.velocity, window, wanted);
    inverse.compute(window.now.u, window.now.velocity, window, command);
    if (t > 0.2) {
      const bool corner = std::abs(t - 1.0) < 0.05;  // theta'' of (24) jumps at 1 s
      double& worst = corner ? spike : error_inverse;
      worst = std::max(worst, (behind_inverse - wanted.tau_u_nm).lpNorm<Eigen::Infinity>());
      error_plain =
          std::max(error_plain, (behind_plain - wanted.tau_u_nm).lpNorm<Eigen::Infinity>());
    }
    behind_inverse += dt / 0.02 * (command.tau_u_nm - behind_inverse);
    behind_plain += dt / 0.02 * (wanted.tau_u_nm - behind_plain);
  }
  EXPECT_LT(error_inverse, 2e-4);
  EXPECT_GT(error_plain, 5e-3);
  EXPECT_LT(spike, 0.02);  // no more than the jump of B u'' itself
}

}  // namespace
}  // namespace softarm
