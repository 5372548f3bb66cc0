// Slow arms without gravity, integrated here by other means: what is sought beyond (16) is found,
// and halves that differ are reported.
#include "softarm/commissioning/identification/model_comparison.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "softarm/commissioning/identification/residual_parts.hpp"
#include "unit/commissioning/identification/records.hpp"

namespace softarm {
namespace {

/// An arm in quasi-static motion behind a lag: u' = (input_map - k b - c |b|^2 b) / beta,
/// b = u - rest.
struct QuasiStaticArm {
  double k = 1.0, beta = 0.5, cubic = 0.0, lag_s = 0.0;
  Eigen::Vector2d rest = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 2, 4> input_map;

  QuasiStaticArm() {
    for (int j = 0; j < 4; ++j) {  // 35 degrees off where they are said to be
      const double angle = 0.6 + M_PI / 2 * j, gain = 0.2 + 0.03 * j;
      input_map.col(j) << -gain * std::cos(angle), -gain * std::sin(angle);
    }
  }

  /// Pressures of three incommensurate periods each, from 1 s on; `gain(t)` scales their moments.
  template <class Gain>
  MotionRecord record(double seconds, const Gain& gain) const {
    constexpr int kSteps = 50;  // of 1 ms, from frame to frame
    const auto frames = static_cast<Eigen::Index>(std::lround(1e3 * seconds / kSteps)) + 1;
    MotionRecord out;
    out.time_s = Eigen::VectorXd::LinSpaced(frames, 0.0, seconds);
    out.u_rad.resize(frames, 2);
    out.input.held = false;
    out.input.time_s = out.time_s;
    out.input.value.setZero(frames, 4);
    for (Eigen::Index i = 0; i < frames; ++i)
      for (Eigen::Index j = 0; j < 4; ++j) {
        const double t = std::max(0.0, out.time_s[i] - 1.0),
                     f = 1.0 + 0.23 * static_cast<double>(j);
        out.input.value(i, j) =
            0.4 * (1.0 - std::cos(0.9 * f * t)) + 0.2 * std::pow(std::sin(0.37 * f * t), 2);
      }
    Eigen::Vector2d u = rest;
    Eigen::Vector4d behind = out.input.value.row(0).transpose();
    out.u_rad.row(0) = u;
    for (Eigen::Index i = 1; i < frames; ++i) {
      const Eigen::Vector4d from = out.input.value.row(i - 1), to = out.input.value.row(i);
      for (int s = 0; s < kSteps; ++s) {
        const double h = (out.time_s[i] - out.time_s[i - 1]) / kSteps;
        const Eigen::Vector4d now = from + (s + 0.5) / kSteps * (to - from);
        const Eigen::Vector4d next =
            lag_s > 0.0 ? Eigen::Vector4d(now + std::exp(-h / lag_s) * (behind - now)) : now;
        const Eigen::Vector2d force =
            gain(out.time_s[i]) * input_map * (lag_s > 0.0 ? 0.5 * (behind + next) : now);
        const auto rate = [&](const Eigen::Vector2d& at) -> Eigen::Vector2d {
          const Eigen::Vector2d b = at - rest;
          return (force - k * b - cubic * b.squaredNorm() * b) / beta;
        };
        u += h * rate(u + 0.5 * h * rate(u));
        behind = next;
      }
      out.u_rad.row(i) = u;
    }
    return out;
  }
  MotionRecord record(double seconds) const {
    return record(seconds, [](double) { return 1.0; });
  }
};

Experiment slow_arm() {
  Experiment experiment = test::one_segment();
  experiment.arm.gravity_mps2.setZero();
  experiment.arm.segments[0].stiffness_nm_per_rad = 1.0;
  return experiment;
}

FitChoice slow_choice() {
  FitChoice choice;
  choice.stiffness = choice.inertia = choice.lag = choice.delay = false;
  choice.directions = true;
  return choice;
}

IdentifyOptions two_threads() {
  IdentifyOptions options;
  options.refinement.threads = 2;
  return options;
}

TEST(ModelComparison, FindsDirectionsRestLagAndCubicStiffness) {
  QuasiStaticArm truth;
  truth.cubic = 5.0;
  truth.lag_s = 0.3;
  truth.rest << 0.05, -0.03;
  const MotionRecord record = truth.record(30.0);
  FitChoice choice = slow_choice();
  choice.rest = choice.lag = choice.cubic = true;
  const ModelComparison found = compare_models(slow_arm(), record, choice, two_threads(), nullptr);

  // What was asked is the arm itself.
  const ParameterSet set(configured(slow_arm()), ActuationKind::chambers, choice);
  const CrossValidation& asked = found.trials.back().result;
  EXPECT_TRUE(asked.converged);
  const ArmHypothesis arm = set.arm(asked.whole.x);
  EXPECT_NEAR(arm.arm.segments[0].damping_nms_per_rad, truth.beta, 1e-3 * truth.beta);
  EXPECT_NEAR(arm.lag_s, truth.lag_s, 1e-3 * truth.lag_s);
  EXPECT_NEAR(arm.cubic_nm_per_rad3, truth.cubic, 1e-3 * truth.cubic);
  EXPECT_LT((arm.rest_rad - truth.rest).norm(), 1e-4);
  EXPECT_LT((arm.input_map - truth.input_map).norm(), 1e-3 * truth.input_map.norm());
  EXPECT_LT(asked.second_by_first_rad, 1e-5);
  EXPECT_LT(asked.first_by_second_rad, 1e-5);

  // Each term alone leaves the others over, and none makes the whole worse.
  const auto whole = [&](const char* name) {
    const auto trial = std::find_if(found.trials.begin(), found.trials.end(),
                                    [&](const ModelTrial& each) { return each.name == name; });
    return trial == found.trials.end() ? -1.0 : trial->result.whole.rms_rad;
  };
  const double plain = whole("(16): gains, beta");
  EXPECT_GT(plain, 5e-3);
  EXPECT_LT(plain, whole("gains; no damping"));
  for (const char* term : {"rest offset", "lag", "delay", "cubic stiffness"}) {
    EXPECT_GT(whole(("(16) + " + std::string(term)).c_str()), 100.0 * asked.whole.rms_rad) << term;
    EXPECT_LT(whole(("(16) + " + std::string(term)).c_str()), 1.0001 * plain) << term;
  }
  const std::string text = comparison_text(found);
  EXPECT_EQ(text.find("NOT CONVERGED"), std::string::npos) << text;
}

TEST(ModelComparison, HalvesThatDifferAreReported) {
  // In the second half everything pushes twice as much; u is linear in what pushes.
  const QuasiStaticArm truth;
  const MotionRecord record = truth.record(40.0, [](double t) { return t <= 20.0 ? 1.0 : 2.0; });
  const ParameterSet set(configured(slow_arm()), ActuationKind::chambers, slow_choice());
  const CrossValidation found = cross_validate(set, record, two_threads());
  const auto rms = [&](double from_s, double to_s) {
    const Eigen::MatrixXd part = record.part(from_s, to_s, 0.0).u_rad;
    return std::sqrt(part.squaredNorm() / static_cast<double>(part.size()));
  };
  EXPECT_NEAR(found.second_by_first_rad, 0.5 * rms(20.0, 41.0), 0.05 * rms(20.0, 41.0));
  EXPECT_NEAR(found.first_by_second_rad, rms(0.0, 20.0), 0.05 * rms(0.0, 20.0));
  EXPECT_LT(found.whole.rms_rad, found.second_by_first_rad);

  const CrossValidation same = cross_validate(set, truth.record(40.0), two_threads());
  EXPECT_TRUE(same.converged);
  EXPECT_LT(same.whole.rms_rad, 1e-5);
  EXPECT_LT(same.second_by_first_rad, 1e-5);
  EXPECT_LT(same.first_by_second_rad, 1e-5);
}

TEST(ModelComparison, ALagThatWouldBeNegativeRestsAtItsLimit) {
  QuasiStaticArm truth;
  MotionRecord record = truth.record(30.0);
  record.input.time_s.array() += 0.1;  // u is ahead of its input
  FitChoice choice = slow_choice();
  choice.lag = true;
  const ParameterSet set(configured(slow_arm()), ActuationKind::chambers, choice);
  const Refinement fit = identify(set, record, two_threads());
  EXPECT_TRUE(fit.converged);
  // beta / k is a lag, too: one of the two rests at its limit.
  const ArmHypothesis arm = set.arm(fit.x);
  const double least_beta = set[0].lowest;
  EXPECT_NEAR(std::min(arm.lag_s, arm.arm.segments[0].damping_nms_per_rad - least_beta), 0.0, 1e-9);
  EXPECT_LT(fit.rms_rad, 0.2 * fit.motion_rms_rad);
}

TEST(ModelComparison, InertiaDoesNotCountInSlowMotion) {
  // From beta 0.06 to 0.3 N m s/rad: the search leaves the steps with which it began, which are
  // not stable where it ends.
  QuasiStaticArm truth;
  truth.beta = 0.3;
  const MotionRecord record = truth.record(8.0);
  FitChoice choice = slow_choice();
  choice.inertia = true;
  Experiment experiment = slow_arm();
  experiment.arm.segments[0].damping_nms_per_rad = 0.06;
  ArmHypothesis start = configured(experiment);
  const ParameterSet set(start, ActuationKind::chambers, choice);
  start.input_map = truth.input_map;
  const Refinement fit = refine(set, record, set.of(start), two_threads().refinement);
  EXPECT_TRUE(fit.converged);
  EXPECT_NEAR(set.arm(fit.x).arm.segments[0].damping_nms_per_rad, truth.beta, 1e-2 * truth.beta);
  EXPECT_LT(fit.rms_rad, 1e-3 * fit.motion_rms_rad);
}

TEST(ModelComparison, ResidualsAreTakenApart) {
  const double period_s = 7.0;
  MotionRecord record;
  Refinement fit;
  fit.time_s = Eigen::VectorXd::LinSpaced(2801, 0.0, 140.0);
  record.time_s = record.input.time_s = fit.time_s;
  record.input.value.resize(2801, 2);
  fit.residual_rad.resize(2801, 2);
  for (Eigen::Index k = 0; k < 2801; ++k) {
    const double t = fit.time_s[k], angle = 2.0 * M_PI / period_s * t;
    record.input.value.row(k) << 0.4 + 0.2 * std::sin(angle), 0.4 + 0.2 * std::cos(angle);
    fit.residual_rad.row(k) << 2e-3 * std::sin(3.0 * angle) + 5e-3 * (t / 70.0 - 1.0),
        2e-3 * std::cos(2.0 * angle) - 5e-3 * (t / 70.0 - 1.0);
    fit.residual_rad.row(k).array() += 1e-3 * std::sin(1.618 * angle);  // of no cycle
  }
  fit.rms_rad = std::sqrt(fit.residual_rad.squaredNorm() / 5602.0);
  const ResidualParts parts = residual_parts(record, fit);
  EXPECT_NEAR(parts.period_s, period_s, 0.01 * period_s);
  EXPECT_NEAR(parts.drift_rad, 5e-3 / std::sqrt(3.0), 0.15e-3);
  EXPECT_NEAR(parts.cycle_rad, 2e-3 / std::sqrt(2.0), 0.15e-3);
  EXPECT_NEAR(parts.other_rad, 1e-3 / std::sqrt(2.0), 0.2e-3);

  record.input.value.setConstant(0.3);  // nothing repeats
  const ResidualParts whole = residual_parts(record, fit);
  EXPECT_EQ(whole.period_s, 0.0);
  EXPECT_EQ(whole.other_rad, fit.rms_rad);
}

}  // namespace
}  // namespace softarm
