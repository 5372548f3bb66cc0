// Arms that lag and remember: responses against closed forms, and terms that are chosen because they
// are there.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "dense_solvers.hpp"
#include "softarm/commissioning/identification/fit_report.hpp"
#include "softarm/commissioning/identification/term_selection.hpp"
#include "softarm/commissioning/identification/tip_prediction.hpp"
#include "softarm/config/load.hpp"
#include "softarm/model/segment.hpp"
#include "test_folder.hpp"
#include "unit/commissioning/identification/records.hpp"

namespace softarm {
namespace {

/// One chamber pair along x, without gravity: frames every 50 ms of a pressure given over time.
template <class Pressure>
MotionRecord pressed(double seconds, const Pressure& bar) {
  MotionRecord out;
  const auto frames = static_cast<Eigen::Index>(std::lround(seconds / 0.05)) + 1;
  out.time_s = Eigen::VectorXd::LinSpaced(frames, 0.0, seconds);
  out.u_rad.setZero(frames, 2);
  out.input.held = false;
  out.input.time_s = out.time_s;
  out.input.value.setZero(frames, 4);
  for (Eigen::Index k = 0; k < frames; ++k) {
    const double p = bar(out.time_s[k]);
    out.input.value(k, p < 0.0 ? 0 : 2) = std::abs(p);
  }
  return out;
}

Experiment weightless() {
  Experiment experiment = test::one_segment();
  experiment.arm.gravity_mps2.setZero();
  experiment.arm.segments[0].stiffness_nm_per_rad = 1.0;
  return experiment;
}

TEST(QuasiStatic, SlipSpringMakesThePiecewiseLinearLoop) {
  // f = k u + stop(u): going up from rest, u = f / (k + w) until r, then (f - w r) / k; back from
  // the top, first at k + w again over 2 r.
  ArmHypothesis arm = configured(weightless());
  arm.inertia = false;
  arm.arm.segments[0].damping_nms_per_rad = 0.0;
  const double k = 1.0, w = 0.5, r = 0.1, gain = arm.input_map.col(2).norm(), top_bar = 0.5;
  arm.slip_springs = {{r, w}};
  const MotionRecord record = pressed(
      8.0, [&](double t) { return t < 4.0 ? top_bar * t / 4.0 : top_bar * (2.0 - t / 4.0); });
  Eigen::MatrixXd u;
  ASSERT_TRUE(ResponseModel(record).simulate(arm, 0.05, u));
  const double top = (gain * top_bar - w * r) / k;
  for (Eigen::Index i = 0; i < u.rows(); ++i) {
    const double t = record.time_s[i], f = gain * record.input.value(i, 2);
    const double up = f < (k + w) * r ? f / (k + w) : (f - w * r) / k;
    const double turned = top - (gain * top_bar - f) / (k + w);
    const double down = top - turned < 2.0 * r ? turned : (f + w * r) / k;
    EXPECT_NEAR(u.row(i).norm(), t <= 4.0 ? up : std::abs(down), 1e-9) << t;
  }
}

TEST(QuasiStatic, RemanenceIsTheStandardLinearSolid) {
  // A step of force f: u = f/k at once, and f / (k (1 - share)) in the long run.
  ArmHypothesis arm = configured(weightless());
  arm.inertia = false;
  arm.arm.segments[0].damping_nms_per_rad = 0.0;
  arm.remanence = {0.3, 2.0};
  const MotionRecord record = pressed(40.0, [](double t) { return t > 0.01 ? 0.2 : 0.0; });
  Eigen::MatrixXd u;
  ASSERT_TRUE(ResponseModel(record).simulate(arm, 0.05, u));
  const double at_once = 0.2 * arm.input_map.col(2).norm();
  EXPECT_NEAR(u.row(1).norm(), at_once, 0.02 * at_once);
  EXPECT_NEAR(u.bottomRows<1>().norm(), at_once / 0.7, 1e-3 * at_once);
}

TEST(QuasiStatic, TwoRemanencesCreepWithTheTimesOfTheirSystem) {
  // Without damping u - rest = f / k + z_1 + z_2, T_i z_i' = s_i (u - rest) - z_i: a linear system of
  // two rates; with and without inertia alike where the arm is light.
  ArmHypothesis arm = configured(weightless());
  arm.inertia = false;
  arm.arm.segments[0].damping_nms_per_rad = 0.0;
  arm.remanence = {0.3, 20.0};
  arm.remanence_2 = {0.15, 2.0};
  const MotionRecord record = pressed(60.0, [](double t) { return t > 0.01 ? 0.2 : 0.0; });
  Eigen::MatrixXd u;
  ASSERT_TRUE(ResponseModel(record).simulate(arm, 0.05, u));
  const double at_once = 0.2 * arm.input_map.col(2).norm();
  Eigen::Matrix2d rates;
  rates << (0.3 - 1.0) / 20.0, 0.3 / 20.0, 0.15 / 2.0, (0.15 - 1.0) / 2.0;
  const Eigen::Vector2d settled =
      -rates.inverse() * Eigen::Vector2d(0.3 / 20.0, 0.15 / 2.0) * at_once;
  for (const Eigen::Index frame : {20, 60, 200, 600, 1200}) {
    const double t = record.time_s[frame] - 0.025;  // the pressure rises within the first frame
    const double expected = at_once + (settled - test::exponential(rates * t) * settled).sum();
    EXPECT_NEAR(u.row(frame).norm(), expected, 5e-3 * at_once) << t;
  }
  arm.inertia = true;
  arm.arm.segments[0].damping_nms_per_rad = 0.05;
  Eigen::MatrixXd moved;
  ASSERT_TRUE(ResponseModel(record).simulate(arm, 0.005, moved));
  EXPECT_LT((moved - u).bottomRows(1000).cwiseAbs().maxCoeff(), 0.01 * at_once);
}

TEST(Lengths, AFreshArmTakesASetAndABentOneIsShorter) {
  // Pressed to 0.5 bar, vented, pressed again: the set of the first time stays, no second one comes.
  ArmHypothesis arm = configured(weightless());
  ElongationHypothesis& it = arm.elongation;
  it.offset_m = Eigen::VectorXd::Constant(1, 0.1);
  it.gain_m_per_bar = Eigen::MatrixXd::Constant(1, 4, 0.02);
  it.lags.assign(4, FillVentLag{});
  it.set = 0.25;
  it.by_bend_m_per_rad2 = -0.04;
  MotionRecord record =
      pressed(9.0, [](double t) { return t < 1.0 || (t > 3.0 && t < 5.0) || t > 8.0 ? 0.0 : 0.5; });
  record.u_rad(170, 0) = 0.3;
  record.u_rad(170, 1) = -0.4;
  Eigen::MatrixXd length;
  ResponseModel(record).simulate_lengths(arm, record.u_rad, length);
  const double stretch = 0.02 * 0.5;
  EXPECT_NEAR(length(10, 0), 0.1, 1e-12);
  EXPECT_NEAR(length(40, 0), 0.1 + 1.25 * stretch, 1e-12);
  EXPECT_NEAR(length(80, 0), 0.1 + 0.25 * stretch, 1e-12);
  EXPECT_NEAR(length(120, 0), 0.1 + 1.25 * stretch, 1e-12);
  EXPECT_NEAR(length(170, 0), 0.1 + 0.25 * stretch - 0.04 * 0.25, 1e-12);
}

/// Stretches by 20 mm/bar a chamber, of 110 mm; is 30 mm/rad^2 shorter where it bends, and the stiffer
/// the longer it is.
ArmHypothesis taut(const Experiment& experiment) {
  ArmHypothesis out = configured(experiment);
  out.inertia = false;
  out.arm.segments[0].damping_nms_per_rad = 0.02;
  ElongationHypothesis& it = out.elongation;
  it.offset_m = Eigen::VectorXd::Constant(1, 0.11);
  it.gain_m_per_bar = Eigen::MatrixXd::Constant(1, 4, 0.02);
  it.lags.assign(4, FillVentLag{});
  it.by_bend_m_per_rad2 = -0.03;
  out.stiffening_by_length = 4.0;
  return out;
}

TEST(QuasiStatic, AStretchedSegmentIsStifferByItsLength) {
  // Settled: gain p = k (l / L)^4 u with l = 0.11 + 0.02 p - 0.03 u^2.
  ArmHypothesis arm = taut(weightless());
  const MotionRecord record = pressed(8.0, [](double t) { return t > 0.01 ? 0.8 : 0.0; });
  const auto left_nm = [&](double u) {
    const double l = 0.11 + 0.02 * 0.8 - 0.03 * u * u;
    return 0.8 * arm.input_map.col(2).norm() - std::pow(l / 0.11, 4.0) * u;
  };
  Eigen::MatrixXd u;
  ASSERT_TRUE(ResponseModel(record).simulate(arm, 0.05, u));
  EXPECT_GT(u.bottomRows<1>().norm(), 0.3);
  EXPECT_NEAR(left_nm(u.bottomRows<1>().norm()), 0.0, 1e-9);
  arm.inertia = true;
  ASSERT_TRUE(ResponseModel(record).simulate(arm, 0.005, u));
  EXPECT_NEAR(left_nm(u.bottomRows<1>().norm()), 0.0, 1e-6);
  MotionRecord known = record;  // lengths of another arm, which are known, come first
  known.lengths = ResponseModel(record).lengths_of(arm);
  arm.elongation = {};
  Eigen::MatrixXd same;
  ASSERT_TRUE(ResponseModel(known).simulate(arm, 0.005, same));
  EXPECT_EQ(same, u);
}

TEST(InputTrack, AveragesOfMeasurementsStayOnStraightLines) {
  InputTrack track;
  track.held = false;
  track.time_s = Eigen::VectorXd::LinSpaced(401, 0.0, 4.0);
  track.value = (0.1 + 0.2 * track.time_s.array()).matrix();
  const InputTrack few = track.averaged(0.05);
  EXPECT_LT(few.time_s.size(), 90);
  EXPECT_EQ(few.time_s[0], 0.0);
  EXPECT_EQ(few.time_s[few.time_s.size() - 1], 4.0);
  for (Eigen::Index k = 0; k < few.time_s.size(); ++k) {
    EXPECT_NEAR(few.value(k, 0), 0.1 + 0.2 * few.time_s[k], 1e-12);
    if (k > 0) {
      EXPECT_GT(few.time_s[k], few.time_s[k - 1]);
    }
  }
  track.held = true;
  EXPECT_EQ(track.averaged(0.05).time_s.size(), 401);
}

TEST(LaggedInput, FillsAndVentsWithTwoTimes) {
  InputTrack track;
  track.time_s = Eigen::Vector3d(0.0, 1.0, 3.0);
  track.value = Eigen::Vector3d(0.0, 1.0, 0.0);
  LaggedInput lagged(track, {FillVentLag{0.6, 1.5}}, 0.0);
  Eigen::VectorXd p(1);
  lagged.at(2.0, p);
  EXPECT_NEAR(p[0], 1.0 - std::exp(-1.0 / 0.6), 1e-12);
  lagged.at(3.0, p);
  const double full = 1.0 - std::exp(-2.0 / 0.6);
  EXPECT_NEAR(p[0], full, 1e-12);
  lagged.at(4.0, p);
  EXPECT_NEAR(p[0], full * std::exp(-1.0 / 1.5), 1e-12);
}

TEST(TermSelection, KeepsWhatIsThereAndLeavesOutWhatIsNot) {
  Experiment experiment = weightless();
  FitChoice plain;
  plain.stiffness = plain.inertia = plain.lag = plain.delay = false;
  ArmHypothesis truth = configured(experiment);
  truth.inertia = false;
  truth.arm.segments[0].damping_nms_per_rad = 0.05;
  truth.lags.assign(4, FillVentLag{0.1, 0.8});
  truth.slip_springs = {{0.05, 0.6}};
  MotionRecord record = pressed(40.0, [](double t) {
    return 0.3 * std::sin(1.1 * t) + 0.15 * std::sin(0.37 * t) * std::sin(2.3 * t);
  });
  ASSERT_TRUE(ResponseModel(record).simulate(truth, 0.05, record.u_rad));
  test::add_noise(record, 5e-4, 0.0, 3);
  SelectionOptions options;
  options.identify.window_s = 0.5;
  options.identify.refinement.weighted = false;
  options.identify.refinement.prior = 1.0;
  options.identify.refinement.least_gain = 0.05;
  options.identify.refinement.threads = 2;
  const std::vector<Fold> folds = halves(record);
  const SelectedModel found = select_terms(configured(experiment), ActuationKind::chambers, plain,
                                           std::span(&record, 1), folds, options);
  EXPECT_TRUE(found.choice.venting || found.choice.chamber_lags);
  EXPECT_TRUE(found.choice.hysteresis);
  EXPECT_FALSE(found.choice.cross);
  EXPECT_LT(found.whole.rms_rad, 3e-3);
  // Every trial has its price, and the error on what was not seen never grows with what is kept.
  double best = found.trials.front().unseen;
  for (const TermTrial& trial : found.trials) {
    EXPECT_GT(trial.parameters, 0);
    if (!trial.kept) continue;
    EXPECT_LE(trial.unseen, best);
    best = trial.unseen;
  }
}

/// Two chambers of a pair that stretch the arm together and bend it apart.
TEST(TermSelection, FindsHowStiffnessFollowsTheLength) {
  const Experiment experiment = weightless();
  const ArmHypothesis truth = taut(experiment);
  FitChoice plain;
  plain.stiffness = plain.inertia = plain.lag = plain.delay = false;
  plain.gains = GainSharing::arm;
  MotionRecord record =
      pressed(20.0, [](double t) { return 0.3 * std::sin(1.1 * t) * std::cos(0.4 * t); });
  for (Eigen::Index k = 0; k < record.time_s.size(); ++k)
    record.input.value.row(k).array() += 0.4 + 0.4 * std::sin(0.23 * record.time_s[k]);
  ASSERT_TRUE(ResponseModel(record).simulate(truth, 0.05, record.u_rad));
  Eigen::MatrixXd length;
  ResponseModel(record).simulate_lengths(truth, record.u_rad, length);
  record.chord_m = chords_m(record.u_rad, length);
  test::add_noise(record, 5e-4, 0.0, 3);
  SelectionOptions options;
  options.identify.refinement.weighted = false;
  options.identify.refinement.prior = 1.0;
  options.identify.refinement.threads = 2;
  const SelectedArm found = select_arm(configured(experiment), ActuationKind::chambers, plain,
                                       {record}, halves(record), options);
  EXPECT_TRUE(found.lengths.choice.by_bend);
  EXPECT_NEAR(found.bend.arm.elongation.by_bend_m_per_rad2, -0.03, 2e-3);
  EXPECT_TRUE(found.bend.choice.by_length);
  EXPECT_LT(found.bend.whole.rms_rad, 1e-3);
  // What was found predicts without what the search knew.
  Eigen::MatrixXd u;
  ASSERT_TRUE(ResponseModel(record).simulate(found.bend.arm, 0.05, u));
  EXPECT_LT((u - record.u_rad).cwiseAbs().maxCoeff(), 0.01);
  // Where no other term stands in for it, the exponent itself is found.
  FitChoice alone = plain;
  alone.by_length = true;
  record.lengths = ResponseModel(record).lengths_of(truth);
  const ParameterSet set(configured(experiment), ActuationKind::chambers, alone);
  const Refinement fit = identify(set, record, options.identify);
  EXPECT_NEAR(set.arm(fit.x).stiffening_by_length, 4.0, 0.1);
}

/// Chambers pressed in turn by one sine of 0.2 Hz, behind a delay and nothing else.
struct Delayed {
  Delayed() {
    experiment.arm.segments[0].damping_nms_per_rad = 0.01;
    plain.stiffness = plain.damping = plain.inertia = plain.lag = plain.delay = false;
    plain.gains = GainSharing::arm;
    ArmHypothesis truth = configured(experiment);
    truth.inertia = false;
    truth.dead_time_s = 0.25;
    record = pressed(40.0, [](double t) { return 0.3 * std::sin(0.4 * M_PI * t); });
    EXPECT_TRUE(ResponseModel(record).simulate(truth, 0.05, record.u_rad));
    test::add_noise(record, 0.02, 0.0, 3);
    options.identify.window_s = 0.5;
    options.identify.refinement.weighted = false;
    options.identify.refinement.prior = 1.0;
  }
  SelectedModel select(int threads) {
    options.identify.refinement.threads = threads;
    return select_terms(configured(experiment), ActuationKind::chambers, plain,
                        std::span(&record, 1), halves(record), options);
  }

  Experiment experiment = weightless();
  FitChoice plain;
  MotionRecord record;
  SelectionOptions options;
};

/// Behind one sine a lag is nearly what a delay is. It is tried first; then neither the delay beside
/// it gains nor can it go, and the model with the delay alone is two steps away.
TEST(TermSelection, ExchangesATermWhereNoSingleStepHelps) {
  const SelectedModel found = Delayed().select(1);
  const auto kept = [&](const std::string& name) {
    int out = -1;  // never tried
    for (const TermTrial& trial : found.trials)
      if (trial.name == name) out = std::max(out, trial.kept ? 1 : 0);
    return out;
  };
  EXPECT_EQ(kept("filling and venting"), 1);
  EXPECT_EQ(kept("delay"), 0);
  EXPECT_EQ(kept("without filling and venting"), 0);
  EXPECT_EQ(kept("delay for filling and venting"), 1);
  EXPECT_TRUE(found.choice.delay);
  EXPECT_FALSE(found.choice.venting || found.choice.chamber_lags);
  EXPECT_NEAR(found.arm.dead_time_s, 0.25, 0.02);
}

TEST(TermSelection, DoesNotDependOnThreads) {
  const SelectedModel one = Delayed().select(1), five = Delayed().select(5);
  ASSERT_EQ(one.trials.size(), five.trials.size());
  for (std::size_t i = 0; i < one.trials.size(); ++i) {
    EXPECT_EQ(one.trials[i].name, five.trials[i].name);
    EXPECT_EQ(one.trials[i].kept, five.trials[i].kept);
    EXPECT_EQ(one.trials[i].unseen_of, five.trials[i].unseen_of);
  }
  EXPECT_EQ(one.whole.x, five.whole.x);
}

/// An arm with three chambers a segment, what was identified of it, and the file that says so.
struct FoundArm {
  explicit FoundArm(int segments)
      : base(folder.write("base.yaml", fmt::format(R"(
name: base
arm: {{segments: {}, length_m: 0.1, mass_kg: 0.1, stiffness_nm_per_rad: 1, damping_nms_per_rad: 0.1}}
actuation: {{chambers: {{angle_rad: [0, 2*pi/3, 4*pi/3], gain_nm_per_bar: 0.3}}, max_pressure_bar: 1}}
control: {{kp_nm_per_rad: 0, valve_lag_s: 0.8}}
reference: [{{kind: set_point, theta_rad: 0}}]
)",
                                                   segments))),
        experiment(load_experiment(base)),
        arm(configured(experiment)) {}

  Experiment written() const {
    const auto file = folder.path() / "found.yaml";
    folder.write("found.yaml", identified_yaml(experiment, arm, choice, "test", base, file));
    return load_experiment(file);
  }

  TestFolder folder;
  std::filesystem::path base;
  Experiment experiment;
  ArmHypothesis arm;
  FitChoice choice;
};

TEST(IdentifiedYaml, HoldsEveryTermAndLoadsAgain) {
  FoundArm found(2);
  ArmHypothesis& arm = found.arm;
  found.choice.directions = true;
  arm.inertia = false;
  for (Eigen::Index j = 0; j < 6; ++j)  // all push to one side: no actuation of a controller
    arm.input_map.col(j) << 0.1 + 0.01 * static_cast<double>(j), 0.02 * static_cast<double>(j);
  for (int j = 0; j < 6; ++j) arm.lags.push_back({0.1 + 0.1 * j, 0.5 + 0.2 * j});
  arm.saturation_1pbar = Eigen::VectorXd::LinSpaced(6, -0.5, 0.5);
  arm.stiffening_1pbar = 0.2;
  arm.stiffening_by_length = 3.5;
  arm.cross_nm_per_bar = Eigen::MatrixXd::Random(4, 6);
  arm.slip_springs = {{0.01, 0.3}, {0.05, 0.2}};
  arm.remanence = {0.2, 17.0};
  arm.remanence_2 = {0.1, 3.0};
  arm.remanent_rad = Eigen::Vector4d(0.01, -0.02, 0.03, 0.04);
  arm.load_kg = 0.05;
  ElongationHypothesis& stretch = arm.elongation;
  stretch.offset_m = Eigen::Vector2d(0.11, 0.12);
  stretch.gain_m_per_bar = Eigen::MatrixXd::Random(2, 6) * 0.02;
  stretch.lags.assign(6, {0.2, 0.9});
  stretch.saturation_1pbar = Eigen::VectorXd::LinSpaced(6, 0.1, 0.3);
  stretch.friction_m = 1e-3;
  stretch.remanence = {0.1, 40.0};
  stretch.remanence_2 = {0.05, 4.0};
  stretch.set = 0.15;
  stretch.by_bend_m_per_rad2 = -0.02;

  const ArmHypothesis loaded = configured(found.written());
  EXPECT_EQ(loaded.inertia, arm.inertia);
  EXPECT_LT((loaded.input_map - arm.input_map).norm(), 1e-6);
  ASSERT_EQ(loaded.lags.size(), 6U);
  for (std::size_t j = 0; j < 6; ++j) {
    EXPECT_NEAR(loaded.lags[j].fill_s, arm.lags[j].fill_s, 1e-6);
    EXPECT_NEAR(loaded.lags[j].vent_s, arm.lags[j].vent_s, 1e-6);
  }
  EXPECT_LT((loaded.saturation_1pbar - arm.saturation_1pbar).norm(), 1e-6);
  EXPECT_NEAR(loaded.stiffening_1pbar, 0.2, 1e-9);
  EXPECT_NEAR(loaded.stiffening_by_length, 3.5, 1e-9);
  EXPECT_LT((loaded.cross_nm_per_bar - arm.cross_nm_per_bar).norm(), 1e-6);
  ASSERT_EQ(loaded.slip_springs.size(), 2U);
  EXPECT_NEAR(loaded.slip_springs[1].radius_rad, 0.05, 1e-9);
  EXPECT_NEAR(loaded.slip_springs[1].stiffness_nm_per_rad, 0.2, 1e-9);
  EXPECT_NEAR(loaded.remanence.share, 0.2, 1e-9);
  EXPECT_NEAR(loaded.remanence.time_s, 17.0, 1e-9);
  EXPECT_NEAR(loaded.remanence_2.share, 0.1, 1e-9);
  EXPECT_NEAR(loaded.remanence_2.time_s, 3.0, 1e-9);
  EXPECT_LT((loaded.remanent_rad - arm.remanent_rad).norm(), 1e-6);
  EXPECT_NEAR(loaded.load_kg, 0.05, 1e-9);
  EXPECT_LT((loaded.elongation.offset_m - stretch.offset_m).norm(), 1e-6);
  EXPECT_LT((loaded.elongation.gain_m_per_bar - stretch.gain_m_per_bar).norm(), 1e-6);
  EXPECT_NEAR(loaded.elongation.lags[3].vent_s, 0.9, 1e-9);
  EXPECT_LT((loaded.elongation.saturation_1pbar - stretch.saturation_1pbar).norm(), 1e-6);
  EXPECT_NEAR(loaded.elongation.friction_m, 1e-3, 1e-9);
  EXPECT_NEAR(loaded.elongation.remanence.time_s, 40.0, 1e-9);
  EXPECT_NEAR(loaded.elongation.remanence_2.share, 0.05, 1e-9);
  EXPECT_NEAR(loaded.elongation.remanence_2.time_s, 4.0, 1e-9);
  EXPECT_NEAR(loaded.elongation.set, 0.15, 1e-9);
  EXPECT_NEAR(loaded.elongation.by_bend_m_per_rad2, -0.02, 1e-9);
}

/// What was identified is what the tick inverts; what was not, and what was configured only, is not.
TEST(IdentifiedYaml, InvertsTheActuatorsThatWereFound) {
  FoundArm found(1);
  ArmHypothesis& arm = found.arm;
  arm.lags = {{0.5, 1.4}, {0.6, 1.5}, {0.7, 1.2}};
  arm.slip_springs = {{0.01, 0.3}, {0.05, 0.2}};
  arm.stiffening_1pbar = 0.25;
  FitChoice& choice = found.choice;
  EXPECT_FALSE(found.written().actuator_inverse.any()) << "as configured";
  choice.chamber_lags = choice.hysteresis = choice.stiffening = true;
  const Experiment all = found.written();
  const ActuatorInverseSettings& inverse = all.actuator_inverse;
  ASSERT_EQ(inverse.fill_lag_s.size(), 3U);
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_NEAR(inverse.fill_lag_s[j], arm.lags[j].fill_s, 1e-6);
    EXPECT_NEAR(inverse.vent_lag_s[j], arm.lags[j].vent_s, 1e-6);
  }
  ASSERT_EQ(inverse.slip_radius_rad.size(), 2U);
  EXPECT_NEAR(inverse.slip_radius_rad[1], 0.05, 1e-9);
  EXPECT_NEAR(inverse.slip_stiffness_nm_per_rad[1], 0.2, 1e-9);
  EXPECT_NEAR(inverse.stiffening_per_bar, 0.25, 1e-9);
  EXPECT_NEAR(all.control.valve_lag_s, 0.15, 1e-9) << "a tenth of the longest lag";
  arm.stiffening_1pbar = -0.1;  // what no pressure does is not inverted
  EXPECT_EQ(found.written().actuator_inverse.stiffening_per_bar, 0.0);
}

TEST(TipPrediction, ChordsOfConstantCurvatureGiveTheTip) {
  MotionRecord record;
  record.time_s = Eigen::VectorXd::LinSpaced(50, 0.0, 5.0);
  record.u_rad = 0.5 * Eigen::MatrixXd::Random(50, 4);
  record.chord_m.resize(50, 6);
  const double lengths[2] = {0.11, 0.14};
  for (Eigen::Index k = 0; k < 50; ++k)
    for (Eigen::Index i = 0; i < 2; ++i)
      record.chord_m.row(k).segment<3>(3 * i) =
          segment_tip(lengths[i], record.u_rad.row(k).segment<2>(2 * i).transpose());
  EXPECT_LT((chord_bends_rad(record.chord_m) - record.u_rad).cwiseAbs().maxCoeff(), 1e-12);
  const Eigen::MatrixXd found = chord_lengths_m(record);
  EXPECT_LT((found.col(0).array() - lengths[0]).abs().maxCoeff(), 1e-12);
  EXPECT_LT((found.col(1).array() - lengths[1]).abs().maxCoeff(), 1e-12);
  const ChordMap map = fit_chords(std::span(&record, 1));
  EXPECT_LT((map.of_bend - ChordMap::identity(2).of_bend).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((chords_m(map.bend_rad(record.u_rad), found) - record.chord_m).cwiseAbs().maxCoeff(),
            1e-9);
}

}  // namespace
}  // namespace softarm
