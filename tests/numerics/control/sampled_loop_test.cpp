// What linear theory says of stability and of softness, against simulated arms.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "dev/bench/control_bench.hpp"
#include "dev/bench/control_trials.hpp"
#include "softarm/config/load.hpp"
#include "softarm/control/gain_check.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/statics.hpp"

namespace softarm {
namespace {

using Eigen::VectorXd;

Experiment configured(const char* name) {
  return load_experiment(std::string(SOFTARM_SOURCE_DIR "/config/") + name);
}

Experiment with_gains(Experiment experiment, double kp, double kd = 0.0) {
  std::fill(experiment.control.kp.begin(), experiment.control.kp.end(), kp);
  std::fill(experiment.control.kd.begin(), experiment.control.kd.end(), kd);
  return experiment;
}

VectorXd straight(const Experiment& experiment) { return VectorXd::Zero(experiment.arm.dof()); }

LoopSampling sampling_of_plant(const Experiment& experiment) {
  return {.control_period_s = 1.0 / experiment.rate_hz,
          .frame_period_s = 1.0 / experiment.plant.mocap.rate_hz,
          .frame_latency_s = experiment.plant.mocap.latency_s,
          .filter_bandwidth_radps = experiment.estimation.filter_bandwidth_radps,
          .dead_time_s = experiment.plant.valves.dead_time_s,
          .valve_lag_s = experiment.plant.valves.lag_s};
}

double limit_of(const Experiment& experiment) {
  const VectorXd ones = VectorXd::Ones(experiment.arm.dof());
  return largest_gain_factor(experiment.arm, sampling_of_plant(experiment), ones, 0.0 * ones, true);
}

double growth_of(const Experiment& experiment) {
  const auto& control = experiment.control;
  const VectorXd kp = Eigen::Map<const VectorXd>(control.kp.data(), experiment.arm.dof());
  return loop_growth_1ps(experiment.arm, sampling_of_plant(experiment), kp, 0.0 * kp,
                         control.terms.gravity);
}

TEST(SampledLoop, TheoryAndSimulationLoseStabilityTogether) {
  struct Case {
    double lag_s, dead_time_s, rate_hz, bandwidth_radps;
  };
  // Without a lag it is the filter that limits.
  for (const Case& each :
       {Case{0.0, 0.0, 500.0, 80.0}, Case{0.0, 0.0, 500.0, 150.0}, Case{0.02, 0.0, 500.0, 80.0},
        Case{0.02, 0.01, 500.0, 80.0}, Case{0.05, 0.0, 100.0, 80.0}}) {
    Experiment experiment = with_gains(configured("paper_arm.yaml"), 1.0);
    experiment.plant.valves.lag_s = experiment.control.valve_lag_s = each.lag_s;
    experiment.plant.valves.dead_time_s = each.dead_time_s;
    experiment.rate_hz = each.rate_hz;
    experiment.estimation.filter_bandwidth_radps = each.bandwidth_radps;
    const double limit = limit_of(experiment);
    EXPECT_GT(limit, 0.3);
    EXPECT_LT(limit, 6.0);
    // Within 5 % on either side: the arm is not linear, and fading is seen for three seconds only.
    EXPECT_TRUE(kick(with_gains(experiment, 0.95 * limit)).stable) << limit << " " << each.lag_s;
    EXPECT_FALSE(kick(with_gains(experiment, 1.05 * limit)).stable) << limit << " " << each.lag_s;
  }
}

TEST(SampledLoop, GrowthIsThatOfASimulatedBlow) {
  const Experiment base = with_gains(configured("paper_arm.yaml"), 1.0);
  const double limit = limit_of(base);
  for (const double share : {0.9, 1.05}) {
    const Experiment experiment = with_gains(base, share * limit);
    EXPECT_NEAR(kick(experiment).growth_1ps, growth_of(experiment), 0.15) << share * limit;
  }
}

TEST(SampledLoop, WithoutFeedbackTheArmDecaysByItself) {
  Experiment experiment = with_gains(configured("paper_arm.yaml"), 0.0);
  experiment.control.terms.gravity = false;
  // The slowest mode of B s^2 + D s + K + G_u.
  const Eigen::Index dof = experiment.arm.dof();
  DynamicsWorkspace workspace(experiment.arm);
  Eigen::MatrixXd B(dof, dof), C(dof, dof), A = Eigen::MatrixXd::Zero(2 * dof, 2 * dof);
  VectorXd G(dof);
  const VectorXd zero = straight(experiment);
  dynamics_matrices(experiment.arm, workspace, zero, zero, B, C, G);
  const SegmentParameters& segment = experiment.arm.segments[0];  // all are alike
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(dof, dof);
  const Eigen::MatrixXd stiffness =
      gravity_slope(experiment.arm, zero) + segment.stiffness_nm_per_rad * one;
  A.topRightCorner(dof, dof) = one;
  const Eigen::MatrixXd mobility = B.inverse();
  A.bottomLeftCorner(dof, dof) = -mobility * stiffness;
  A.bottomRightCorner(dof, dof) = -segment.damping_nms_per_rad * mobility;
  const double slowest = A.eigenvalues().real().maxCoeff();
  EXPECT_LT(slowest, -1.0);
  // Windows of whole frames, not of whole oscillations: 2 %.
  EXPECT_NEAR(growth_of(experiment), slowest, 0.02 * std::abs(slowest));
}

TEST(TipCompliance, IsWhatASimulatedPushFinds) {
  Experiment experiment = configured("paper_arm_nominal.yaml");
  const VectorXd rest = straight(experiment);
  experiment.reference.phases = {{SetPointReference{std::vector<double>(6, 0.0)}, 0.0}};
  for (const double kp : {0.0, 2.0}) {
    const double predicted =
        tip_compliance(experiment.arm, rest, VectorXd::Constant(6, kp), true)(0, 0);
    EXPECT_NEAR(measured_tip_compliance(with_gains(experiment, kp), 0.02), predicted,
                0.01 * predicted)
        << kp;
  }
  // Passive, gravity helps to keep it straight.
  experiment = with_gains(experiment, 0.0);
  experiment.control.terms = {false, false, false, false, false};
  const double passive = tip_compliance(experiment.arm, rest, VectorXd::Zero(6), false)(0, 0);
  EXPECT_LT(passive, tip_compliance(experiment.arm, rest, VectorXd::Zero(6), true)(0, 0));
  EXPECT_NEAR(measured_tip_compliance(experiment, 0.02), passive, 0.01 * passive);
}

TEST(TipCompliance, IsSymmetricAndRefusesWhatDoesNotFit) {
  const Experiment experiment = configured("paper_arm.yaml");
  const VectorXd u = VectorXd::LinSpaced(6, -0.6, 0.9);
  const Eigen::Matrix3d compliance = tip_compliance(experiment.arm, u, VectorXd::Ones(6), false);
  EXPECT_LT((compliance - compliance.transpose()).norm(), 1e-9 * compliance.norm());
  EXPECT_THROW(tip_compliance(experiment.arm, u.head(4), VectorXd::Ones(6), false),
               std::invalid_argument);
}

TEST(IntegralGain, MakesTheTipGiveWayNoMoreAndTracksUnderAWrongModel) {
  Experiment experiment = configured("paper_arm_nominal.yaml");
  experiment.reference.phases = {{SetPointReference{std::vector<double>(6, 0.0)}, 0.0}};
  const double without = measured_tip_compliance(experiment, 0.02);
  experiment.control.ki.assign(6, 5.0);
  EXPECT_LT(std::abs(measured_tip_compliance(experiment, 0.02)), 0.02 * without);
}

TEST(ControlBench, PrintsWellFormedJson) {
  Experiment experiment = configured("paper_arm.yaml");
  experiment.run.tracking_from_s = 0.2;
  const ControlScene scene = bench_scene(experiment, 1.0, 0.02, [](const std::string&) {});
  const YAML::Node root = YAML::Load(json(std::vector<ControlScene>{scene}));
  ASSERT_EQ(root["scenes"].size(), 1u);
  EXPECT_EQ(root["scenes"][0]["rates"].size(), 6u);
  ASSERT_EQ(root["scenes"][0]["terms"].size(), 7u);
  for (const auto& row : root["scenes"][0]["terms"]) {
    EXPECT_GT(row["controller_ns"].as<double>(), 0.0);
    EXPECT_GT(row["u_rms_rad"].as<double>(), 0.0);
    EXPECT_TRUE(row["stayed_active"].as<bool>());
  }
  EXPECT_FALSE(table({scene}).empty());
}

}  // namespace
}  // namespace softarm
