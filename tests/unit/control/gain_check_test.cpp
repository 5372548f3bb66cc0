#include "softarm/control/gain_check.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <deque>

#include "control/sampled_loop.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/statics.hpp"
#include "unit/control/arms.hpp"

namespace softarm {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Fast enough to be as good as continuous.
constexpr double kFine_s = 2.5e-4;
LoopSampling fine() {
  return {.control_period_s = kFine_s, .frame_period_s = kFine_s, .filter_bandwidth_radps = 2000.0};
}

/// paper_arm.yaml.
LoopSampling realistic() {
  return {.control_period_s = 0.002,
          .frame_period_s = 0.005,
          .frame_latency_s = 0.005,
          .filter_bandwidth_radps = 80.0,
          .valve_lag_s = 0.02};
}

double limit(const ArmParameters& arm, const LoopSampling& sampling, double kd = 0.0) {
  return largest_gain_factor(arm, sampling, VectorXd::Ones(arm.dof()),
                             VectorXd::Constant(arm.dof(), kd), true);
}

/// Does a small error grow? The arm itself (not linearized), a true dead time, a true lag, gains in
/// u.
bool grows(const ArmParameters& arm, const LoopSampling& sampling, double kp) {
  const int dof = arm.dof();
  const double dt = kFine_s;
  CurvatureController controller(arm, test::gains(arm.size(), kp, 0.0));
  DynamicsWorkspace workspace(arm);
  const VectorXd zero = VectorXd::Zero(dof);
  const ReferenceWindow window = test::at(zero, zero, zero);
  VectorXd state = VectorXd::Zero(2 * dof), force = zero, accel(dof);
  state.head(dof) << VectorXd::LinSpaced(dof, 1e-4, 2e-4);
  const auto delay = static_cast<std::size_t>(std::lround(sampling.dead_time_s / dt));
  std::deque<VectorXd> line(delay, zero);
  ControlOutput out;
  double early = 0.0, late = 0.0;
  for (int i = 0; i < 12000; ++i) {
    controller.compute(state.head(dof), state.tail(dof), window, out);
    line.push_back(out.tau_u_nm);
    const VectorXd arrived = line.front();
    line.pop_front();
    if (sampling.valve_lag_s > 0.0) {
      force += dt / sampling.valve_lag_s * (arrived - force);
    } else {
      force = arrived;
    }
    const auto rate = [&](double, const VectorXd& s) {
      VectorXd r(2 * dof);
      forward_dynamics(arm, workspace, s.head(dof), s.tail(dof), force, accel);
      r << s.tail(dof), accel;
      return r;
    };
    test::runge_kutta(rate, 0.0, dt, state);
    const double size = state.head(dof).lpNorm<Eigen::Infinity>();
    if (i >= 2000 && i < 4000) early = std::max(early, size);
    if (i >= 10000) late = std::max(late, size);
  }
  return !(late < early);
}

TEST(GainCheck, ThePapersArmWithRealisticDelay) {
  // Prototypes: about 2.1 N m/rad with 20 ms of lag and 7.5 ms of delay, 2 rings, 2.5 is unstable.
  const double kp = limit(test::paper_arm(3), realistic(), 0.002);
  EXPECT_GT(kp, 1.6);
  EXPECT_LT(kp, 2.5);
}

TEST(GainCheck, AgreesWithTheSimulatedLoop) {
  const ArmParameters arm = test::paper_arm(3);
  for (const double lag_s : {0.02, 0.0}) {
    LoopSampling sampling = fine();
    sampling.dead_time_s = 0.0075;
    sampling.valve_lag_s = lag_s;
    const double kp = limit(arm, sampling);
    EXPECT_FALSE(grows(arm, sampling, 0.93 * kp)) << lag_s << " " << kp;
    EXPECT_TRUE(grows(arm, sampling, 1.07 * kp)) << lag_s << " " << kp;
  }
}

TEST(GainCheck, OneSegmentWithADeadTimeIsTheTextbooksCase) {
  // B s^2 + beta s + k + G_u + (K_P - G_u) e^(-s T) = 0 on the imaginary axis.
  const ArmParameters arm = test::paper_arm(1);
  const SegmentParameters& segment = arm.segments[0];
  const double k = segment.stiffness_nm_per_rad, beta = segment.damping_nms_per_rad;
  const double slope = gravity_slope(arm, VectorXd::Zero(2))(0, 0);
  DynamicsWorkspace workspace(arm);
  Eigen::MatrixXd B(2, 2), C(2, 2);
  VectorXd G(2);
  dynamics_matrices(arm, workspace, VectorXd::Zero(2), VectorXd::Zero(2), B, C, G);
  for (const double dead_s : {0.004, 0.01, 0.03}) {
    const auto passive = [&](double w) {
      return std::complex<double>(k + slope - B(0, 0) * w * w, beta * w);
    };
    const auto turned = [&](double w) { return -passive(w) * std::polar(1.0, w * dead_s); };
    double w = 1e-3;
    while (turned(w).imag() * turned(w + 1e-4).imag() > 0.0 || turned(w).real() < 0.0) w += 1e-4;
    const double textbook = turned(w).real() + slope;
    LoopSampling sampling = fine();
    sampling.dead_time_s = dead_s;
    // The hold acts half a period late, the filter looks as far ahead.
    EXPECT_NEAR(limit(arm, sampling), textbook, 0.01 * textbook) << dead_s;
  }
}

TEST(GainCheck, MoreDelayLeavesLess) {
  double before = 1e3;
  for (double dead_s : {0.0, 0.002, 0.004, 0.008, 0.016}) {
    LoopSampling sampling = realistic();
    sampling.dead_time_s = dead_s;
    const double kp = limit(test::paper_arm(3), sampling);
    EXPECT_LT(kp, before);
    before = kp;
  }
}

TEST(GainCheck, ANarrowFilterLeavesLessWhereNothingElseIsSlow) {
  LoopSampling sampling = realistic();
  sampling.valve_lag_s = sampling.frame_latency_s = 0.0;
  sampling.control_period_s = sampling.frame_period_s = 0.001;
  const double narrow = limit(test::paper_arm(3), sampling);
  sampling.filter_bandwidth_radps = 300.0;
  EXPECT_GT(limit(test::paper_arm(3), sampling), 1.5 * narrow);
}

/// Half of the modes of a long arm, the slowest and the fastest ones, against all of them.
TEST(GainCheck, ALongArmIsJudgedByItsExtremeModes) {
  constexpr int kSegments = 32;
  const ArmParameters arm = test::paper_arm(kSegments);
  const VectorXd straight = VectorXd::Zero(arm.dof());
  DynamicsWorkspace workspace(arm);
  MatrixXd B(arm.dof(), arm.dof());
  inertia_matrix(arm, workspace, straight, B);
  const MatrixXd slope = gravity_slope(arm, straight);
  const auto plane_of = [&](const MatrixXd& matrix) {
    return MatrixXd(matrix(Eigen::seq(0, Eigen::last, 2), Eigen::seq(0, Eigen::last, 2)));
  };
  const MatrixXd one = MatrixXd::Identity(kSegments, kSegments);
  BendingPlane all{plane_of(B).inverse(),
                   plane_of(slope),
                   arm.segments[0].stiffness_nm_per_rad * one,
                   arm.segments[0].damping_nms_per_rad * one,
                   one,
                   0.01 * one};
  const BendingPlane few = reduced(all, 16);
  int stable = 0, unstable = 0;
  for (double factor = 1e-3; factor < 2e3; factor *= 3.0) {
    const double growth = loop_growth_1ps(all, realistic(), factor, true);
    const double expected = loop_growth_1ps(few, realistic(), factor, true);
    EXPECT_NEAR(growth, expected, 0.02 * std::abs(growth) + 0.02) << factor;
    ++(growth < 0.0 ? stable : unstable);
  }
  EXPECT_GT(stable, 1);
  EXPECT_GT(unstable, 1);
}

TEST(GainCheck, HasNothingToSayWithoutGains) {
  const VectorXd none = VectorXd::Zero(6);
  EXPECT_EQ(largest_gain_factor(test::paper_arm(3), realistic(), none, none, true), 1e3);
  EXPECT_THROW(largest_gain_factor(test::paper_arm(3), realistic(), none.head(4), none, true),
               std::invalid_argument);
}

TEST(GainCheck, WarnsOfThePapersGainsOnlyWhereTheLoopForbidsThem) {
  const ArmParameters arm = test::paper_arm(3);
  ControllerSettings settings = test::gains(3, 0.0, 0.0);
  settings.coordinates = ControlCoordinates::polar;
  settings.kp = {1.2, 0.0, 1.1, 0.0, 1.0, 0.0};
  settings.kd = {0.002, 0.0, 0.002, 0.0, 0.002, 0.0};
  EXPECT_TRUE(gain_warnings(arm, settings, fine(), 0.4).empty());
  EXPECT_FALSE(gain_warnings(arm, settings, fine(), 0.02).empty());  // K_P / theta^2 = 3000 N m/rad
  const std::vector<std::string> warnings = gain_warnings(arm, settings, realistic(), 0.4);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("7.5 N m/rad"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[0].find("phi"), std::string::npos);
}

TEST(GainCheck, WarnsOfGainsInUWithAMargin) {
  const ArmParameters arm = test::paper_arm(3);
  const double largest = limit(arm, realistic());
  const auto warnings = [&](double share) {
    return gain_warnings(arm, test::gains(3, share * largest, 0.0), realistic(), 0.4);
  };
  EXPECT_TRUE(warnings(0.75).empty());
  ASSERT_EQ(warnings(0.9).size(), 2u);  // one a bending plane
  EXPECT_NE(warnings(0.9)[0].find("within"), std::string::npos);
  EXPECT_NE(warnings(1.1)[0].find("beyond"), std::string::npos);
}

}  // namespace
}  // namespace softarm
