// Identification on records whose answer is known by another route.
#include "softarm/commissioning/identification/refinement.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <complex>

#include "softarm/commissioning/identification/fit_report.hpp"
#include "softarm/commissioning/identification/identify.hpp"
#include "unit/commissioning/identification/records.hpp"

namespace softarm {
namespace {

using test::one_segment;

TEST(Refinement, ExactDataOfThePlantGiveItsParameters) {
  Experiment experiment = one_segment();
  experiment.plant.arm.segments[0].stiffness_nm_per_rad = 0.7;
  experiment.plant.arm.segments[0].damping_nms_per_rad = 0.025;
  experiment.plant.actuation.segments[0][2].gain_nm_per_bar = 0.9;
  experiment.plant.valves.lag_s = 0.03;
  // Frames so dense that the response is simulated without a relevant error.
  const MotionRecord record = test::plant_record(experiment, 8, 0.2, 0.2, 2000.0);
  FitChoice choice;
  choice.delay = false;
  const ParameterSet set(configured(experiment), ActuationKind::chambers, choice);
  const Refinement fit = identify(set, record, {});
  EXPECT_TRUE(fit.converged);
  const Eigen::VectorXd truth = set.of(of_plant(experiment));
  for (Eigen::Index i = 0; i < set.size(); ++i)
    EXPECT_NEAR(fit.x[i], truth[i], 1e-6 * std::abs(truth[i])) << set[i].name;
}

TEST(Refinement, SensitivitiesAreThoseOfThePlant) {
  Experiment experiment = one_segment();
  experiment.plant.valves.lag_s = 0.02;
  const MotionRecord record = test::plant_record(experiment, 4, 0.4, 0.3, 1000.0);
  ArmHypothesis start = of_plant(experiment);
  FitChoice choice;
  choice.delay = false;
  choice.gains = GainSharing::arm;
  const ParameterSet set(start, ActuationKind::chambers, choice);
  const Eigen::MatrixXd J = sensitivities(set, record, set.configured(), 2);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const auto at = [&](double part) {
      Experiment moved = experiment;
      SegmentParameters& segment = moved.plant.arm.segments[0];
      if (i == 0) segment.stiffness_nm_per_rad *= 1.0 + part;
      if (i == 1) segment.damping_nms_per_rad *= 1.0 + part;
      if (i == 2)
        for (Chamber& chamber : moved.plant.actuation.segments[0])
          chamber.gain_nm_per_bar *= 1.0 + part;
      if (i == 3) moved.plant.valves.lag_s += part * set[3].scale;
      const MotionRecord seen = test::plant_record(moved, 4, 0.4, 0.3, 1000.0);
      return Eigen::VectorXd(seen.u_rad.transpose().reshaped());
    };
    const Eigen::VectorXd central = (at(1e-3) - at(-1e-3)) / 2e-3;
    EXPECT_LT((J.col(i) - central).norm(), 1e-4 * central.norm()) << set[i].name;
  }
}

/// The step response of m u'' + beta u' + k u = g p, by its roots.
template <class Number>
Number linear_response(double t, double m, Number k, Number beta, Number moment) {
  using Complex = std::complex<double>;
  const Number root = std::sqrt(beta * beta - 4.0 * m * k);
  const Number a = (-beta + root) / (2.0 * m), b = (-beta - root) / (2.0 * m);
  const Number one = Complex(1.0);
  return moment / k * (one + (b * std::exp(a * t) - a * std::exp(b * t)) / (a - b));
}

TEST(Refinement, IntervalsAreThoseOfTheFisherInformation) {
  // So small a bend that the arm is linear; no gravity. One chamber pushes with a gain of 0.8.
  Experiment experiment = one_segment();
  experiment.arm.gravity_mps2.setZero();
  experiment.actuation.segments[0].resize(1);
  experiment.plant.arm = experiment.arm;
  experiment.plant.actuation = experiment.actuation;
  const double k = 0.626, beta = 0.029, g = 0.8, bar = 0.01, noise_rad = 1e-5;
  const double m = 0.15 * 0.11 * 0.11 / 20.0;  // distributed mass, straight
  MotionRecord record = test::plant_record(experiment, 1, bar, 4.0, 500.0);
  test::add_noise(record, noise_rad, 0.0, 5);

  // d u / d (ln k, ln beta, ln g) by complex steps of the closed form, along the chamber's axis.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  using Complex = std::complex<double>;
  for (const double time_s : record.time_s) {
    const double t = time_s - record.input.time_s[1];
    if (t < 0.0) continue;
    const auto derivative = [&](int i) {
      constexpr double kSmall = 1e-30;
      const auto with = [&](double value, int j) {
        return Complex(value, i == j ? kSmall * value : 0.0);
      };
      return linear_response<Complex>(t, m, with(k, 0), with(beta, 1), with(-g * bar, 2)).imag() /
             kSmall;
    };
    const Eigen::Vector3d row(derivative(0), derivative(1), derivative(2));
    information += row * row.transpose() / (noise_rad * noise_rad);
  }
  const Eigen::Matrix3d expected = information.inverse();
  FitChoice choice;
  choice.lag = choice.delay = false;
  const ParameterSet set(of_plant(experiment), ActuationKind::chambers, choice);
  ASSERT_EQ(set.size(), 3);
  RefinementOptions options;
  const Refinement fit = refine(set, record, set.configured(), options);
  EXPECT_TRUE(fit.converged);
  EXPECT_EQ(fit.held, 0);
  // The information in the sensitivities. The mass alone distinguishes k from g, through a
  // transient of a few frames, whose residuals hold little information on the noise: the covariance
  // is compared for the ratio.
  const Eigen::Matrix3d found =
      fit.combinations * fit.singular_values.array().square().inverse().matrix().asDiagonal() *
      fit.combinations.transpose();
  for (Eigen::Index i = 0; i < 3; ++i)
    EXPECT_NEAR(std::sqrt(found(i, i)), std::sqrt(expected(i, i)), 0.15 * std::sqrt(expected(i, i)))
        << set[i].name;
  const Eigen::Vector3d ratio(-1.0, 0.0, 1.0);
  EXPECT_NEAR(std::sqrt(ratio.dot(fit.covariance * ratio)), std::sqrt(ratio.dot(expected * ratio)),
              0.15 * std::sqrt(ratio.dot(expected * ratio)));
}

TEST(Refinement, IntervalsHoldTheTruthWhereNoiseIsFiltered) {
  Experiment experiment = one_segment();
  // So heavy that k, beta and gain are well distinguishable, and the fit is nearly linear in them.
  experiment.arm.gravity_mps2.z() = experiment.plant.arm.gravity_mps2.z() = -60.0;
  const MotionRecord exact = test::plant_record(experiment, 8, 0.2, 0.5, 200.0);
  FitChoice choice;
  choice.gains = GainSharing::arm;
  choice.lag = choice.delay = false;
  const ParameterSet set(of_plant(experiment), ActuationKind::chambers, choice);
  const Eigen::VectorXd truth = set.configured();
  constexpr int kSeeds = 60;
  Eigen::ArrayXi covered = Eigen::ArrayXi::Zero(set.size());
  Eigen::ArrayXi covered_as_if_white = covered;
  for (int seed = 0; seed < kSeeds; ++seed) {
    MotionRecord record = exact;
    test::add_noise(record, 1e-3, 0.9, 100 + static_cast<std::uint64_t>(seed));
    const Refinement fit = refine(set, record, truth, {});
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      const double error = std::abs(fit.x[i] - truth[i]);
      covered[i] += error <= fit.half_width(i) ? 1 : 0;
      covered_as_if_white[i] += error <= fit.half_width(i) / std::sqrt(fit.inflation) ? 1 : 0;
    }
  }
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    EXPECT_GE(covered[i], 51) << set[i].name;  // 57 of 60 expected
    EXPECT_LT(covered_as_if_white[i], 51) << set[i].name;
  }
}

TEST(Refinement, SaysWhatARecordDoesNotTell) {
  // Only chambers 1 and 2 are ever inflated.
  Experiment experiment = one_segment();
  MotionRecord record = test::plant_record(experiment, 2, 0.4, 1.5, 200.0);
  test::add_noise(record, 1e-3, 0.0, 1);
  FitChoice choice;
  choice.lag = choice.delay = false;
  experiment.actuation.segments[0][3].gain_nm_per_bar = 0.5;
  const ParameterSet set(configured(experiment), ActuationKind::chambers, choice);
  const Refinement fit = identify(set, record, {});
  EXPECT_EQ(fit.held, 2);
  EXPECT_NEAR(fit.x[5], 1.0, 1e-6);  // chamber 4, as configured
  const std::string text = conditioning_text(set, fit);
  EXPECT_NE(text.find("not determined by this record"), std::string::npos) << text;
  EXPECT_NE(text.find("segment 1 chamber 4"), std::string::npos) << text;
}

TEST(Refinement, WithoutGravitySlowMotionDeterminesRatiosOnly) {
  Experiment experiment = one_segment();
  experiment.arm.gravity_mps2.setZero();
  MotionRecord record;
  record.time_s = Eigen::VectorXd::LinSpaced(2000, 0.0, 200.0);
  record.input.held = false;
  record.input.time_s = record.time_s;
  record.input.value.setZero(2000, 4);
  for (Eigen::Index k = 0; k < 2000; ++k) {
    record.input.value(k, 0) = 0.2 + 0.2 * std::sin(0.5 * record.time_s[k]);
    record.input.value(k, 1) = 0.2 + 0.2 * std::cos(0.3 * record.time_s[k]);
  }
  FitChoice choice;
  choice.lag = choice.delay = false;
  choice.gains = GainSharing::arm;
  const ParameterSet set(configured(experiment), ActuationKind::chambers, choice);
  const ResponseModel model(record);
  const ArmHypothesis arm = set.arm(set.configured());
  ASSERT_TRUE(model.simulate(arm, model.longest_step_s(arm), record.u_rad));
  test::add_noise(record, 2e-3, 0.0, 2);
  const Refinement fit = refine(set, record, set.configured(), {});
  ASSERT_GE(fit.held, 1);
  // All three by the same factor: the least determined combination.
  EXPECT_GT(std::abs(fit.combinations.col(2).dot(Eigen::Vector3d::Ones().normalized())), 0.98);
}

// The longest step is judged straight and at rest; bent by several radians a lightly damped arm
// needs a shorter one, and has a bounded response all the same.
TEST(Refinement, AnArmBentFarIsSimulatedWithShorterSteps) {
  Experiment experiment = one_segment();
  experiment.arm.gravity_mps2.setZero();
  experiment.arm.segments[0].damping_nms_per_rad = 0.001;
  FitChoice choice;
  choice.gains = GainSharing::arm;
  choice.lag = choice.delay = false;
  MotionRecord record;
  record.time_s = Eigen::VectorXd::LinSpaced(200, 0.0, 199 * 0.05);
  record.input.time_s = Eigen::Vector2d(0.0, 1.0);
  record.input.value.setZero(2, 4);
  record.input.value(1, 0) = 3.0;
  const ResponseModel model(record);
  const ArmHypothesis truth = configured(experiment);
  const double longest_s = model.longest_step_s(truth);
  ASSERT_FALSE(model.simulate(truth, longest_s, record.u_rad));
  ASSERT_TRUE(model.simulate(truth, 0.25 * longest_s, record.u_rad));

  const ParameterSet set(truth, ActuationKind::chambers, choice);
  for (const Refinement& fit :
       {refine(set, record, set.configured(), {}), predict(set, record, set.configured())}) {
    ASSERT_EQ(fit.residual_rad.rows(), record.u_rad.rows());
    EXPECT_LT(fit.rms_rad, 0.2 * fit.motion_rms_rad);
  }
}

TEST(Refinement, RefusesWhatCannotBeSimulated) {
  Experiment experiment = one_segment();
  const MotionRecord record = test::plant_record(experiment, 1, 0.2, 0.2, 200.0);
  experiment.arm.segments.assign(3, experiment.arm.segments[0]);
  experiment.arm.mass = MassModel::point;
  experiment.actuation.segments.assign(3, experiment.actuation.segments[0]);
  const ArmHypothesis arm = configured(experiment);
  EXPECT_THROW(ResponseModel(record).longest_step_s(arm), std::runtime_error);
}

/// Without inertia the fastest mode is (k + G_u) / beta; the weight of an arm that stands out
/// sideways, which is there without a bend, is no part of it.
TEST(Refinement, WithoutInertiaAnyDampingIsSimulatedInTheSameSteps) {
  // Down to none, where every frame is in balance: an explicit step would have to be as short as
  // beta / k.
  Experiment experiment = one_segment();
  experiment.arm.gravity_mps2.setZero();
  const MotionRecord record = test::plant_record(experiment, 2, 0.2, 0.2, 200.0);
  ArmHypothesis arm = configured(experiment);
  arm.inertia = false;
  const ResponseModel model(record);
  const double step_s = model.longest_step_s(arm);
  Eigen::MatrixXd u;
  for (const double beta : {0.0, 1e-9, 1e-3}) {
    arm.arm.segments[0].damping_nms_per_rad = beta;
    EXPECT_EQ(model.longest_step_s(arm), step_s);
    ASSERT_TRUE(model.simulate(arm, step_s, u));
    const Eigen::Vector2d balanced = arm.input_map *
                                     record.input.value.bottomRows<1>().transpose() /
                                     arm.arm.segments[0].stiffness_nm_per_rad;
    EXPECT_LT((u.bottomRows<1>().transpose() - balanced).norm(), 1e-9) << beta;
  }
}

}  // namespace
}  // namespace softarm
