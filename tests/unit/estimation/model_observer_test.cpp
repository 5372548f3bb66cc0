#include "softarm/estimation/model_observer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "counted_malloc.hpp"
#include "milliseconds.hpp"
#include "softarm/base/time.hpp"
#include "softarm/estimation/frame_validator.hpp"
#include "true_arm.hpp"

namespace softarm {
namespace {

using test::SmoothMotion;
using test::TrueArm;

constexpr double kPeriod_s = 2e-3, kLag_s = 0.02;
using test::kMs;

EstimationSettings observer_settings(double noise_rad) {
  EstimationSettings settings;
  settings.orientation_noise_rad = noise_rad;
  settings.observer = ObserverKind::model;
  return settings;
}

/// Observer, arm and clock: commands every 2 ms, frames every 5 ms that arrive 5 ms later.
struct Station {
  Station(const ArmParameters& configured, const ArmParameters& real,
          const EstimationSettings& settings, unsigned seed = 1, double amplitude_rad = 0.3,
          double lag_s = kLag_s)
      : arm(configured),
        estimator(settings, arm, body_noise(settings, arm.size())),
        observer(arm, settings, body_noise(settings, arm.size()),
                 {.valve_lag_s = lag_s, .control_period_s = kPeriod_s}),
        truth(real, lag_s, seed),
        motion(configured, amplitude_rad),
        noise_rad(settings.orientation_noise_rad) {
    at_rest();
  }

  /// At the reference's start, and valves that hold it.
  void at_rest() {
    const KnownMotion start = motion.at(0.0);
    truth.u = start.u_rad;
    truth.velocity = start.velocity_radps;
    truth.tau = truth.command = motion.torque(0.0);
    observer.command(0, truth.command);
  }

  /// 1 ms; every second one a command, every fifth a capture.
  void step() {
    now_ns += kMs;
    truth.advance(1e-3);
    if (now_ns % (5 * kMs) == 0)
      flying.push_back({truth.frame(number++, now_ns, noise_rad), truth.motion()});
    while (!flying.empty() && flying.front().first.capture_ns + latency_ns <= now_ns) {
      auto [frame, reference] = flying.front();
      flying.erase(flying.begin());
      if (corrupt && !corrupt(frame)) continue;
      CurvatureEstimate estimate;
      estimator.estimate(frame, estimate);
      observer.update(frame, estimate, learns ? &reference : nullptr, learns);
      if (each_frame) each_frame();
    }
    if (now_ns % (2 * kMs) == 0) {
      observer.predict(now_ns, now_ns, predicted);
      if (each_tick) each_tick();
      truth.command = motion.torque(to_seconds(now_ns + kMs));
      observer.command(now_ns, truth.command);
    }
  }
  void run(double seconds) {
    for (const std::int64_t end_ns = now_ns + to_ns(seconds); now_ns < end_ns;) step();
  }

  ArmParameters arm;
  CurvatureEstimator estimator;
  ModelObserver observer;
  TrueArm truth;
  SmoothMotion motion;
  double noise_rad;
  bool learns = false;
  std::int64_t now_ns = 0, number = 1, latency_ns = 5 * kMs;
  std::vector<std::pair<MocapFrame, KnownMotion>> flying;
  FilteredMotion predicted;
  std::function<bool(MocapFrame&)> corrupt;
  std::function<void()> each_frame, each_tick;
};

/// RMS of what is predicted for now minus the truth, from `from_s` on.
double prediction_error(Station& station, double from_s, double seconds) {
  double squares = 0.0;
  std::int64_t count = 0;
  station.each_tick = [&] {
    if (to_seconds(station.now_ns) < from_s || !station.predicted.all_valid()) return;
    squares += (station.predicted.u_rad - station.truth.u).squaredNorm();
    count += station.predicted.u_rad.size();
  };
  station.run(seconds);
  return std::sqrt(squares / static_cast<double>(count));
}

TEST(ModelObserver, PredictsAnExactArmThroughLatencyAndLag) {
  const ArmParameters arm = test::arm_of(3);
  Station station(arm, arm, observer_settings(1e-6));
  // 5 ms at 0.9 rad/s would be 4.5 mrad; what is left is the error of steps of 2.5 ms.
  EXPECT_LT(prediction_error(station, 0.3, 1.0), 5e-5);
}

TEST(ModelObserver, IsQuieterThanOneFrame) {
  const ArmParameters arm = test::arm_of(3);
  const EstimationSettings settings = observer_settings(3.5e-3);
  Station station(arm, arm, settings);
  // One frame: 3.5 mrad a body.
  EXPECT_LT(prediction_error(station, 0.5, 3.0), 2e-3);
}

/// The arm's explicit integration knows all of B_ue and C_ue, and inertia along e.
TEST(ModelObserver, FollowsAnArmThatStretches) {
  ArmParameters arm = test::arm_of(3);
  arm.extensible = true;
  Station station(arm, arm, observer_settings(1e-6));
  station.truth.longest_step_s = 1e-4;  // inertia along e, 15000 1/s
  double u = 0.0, e = 0.0;
  station.each_tick = [&] {
    if (to_seconds(station.now_ns) < 0.5) return;
    ASSERT_TRUE(station.predicted.all_valid());
    for (int j = 0; j < 9; ++j) {
      double& largest = j % 3 == 2 ? e : u;
      largest = std::max(largest, std::abs(station.predicted.u_rad[j] - station.truth.u[j]));
    }
  };
  station.run(1.5);
  EXPECT_LT(u, 1e-3);  // of 0.3 rad
  EXPECT_LT(e, 5e-5);  // m, of 9 mm, 5 ms at 25 mm/s would be 0.12 mm
}

TEST(ModelObserver, FindsAxialStiffnessAndAreas) {
  ArmParameters arm = test::arm_of(2);
  arm.extensible = true;
  ArmParameters real = arm;
  real.segments[0].axial_stiffness_n_per_m *= 1.2;
  Station station(arm, real, observer_settings(1e-3));
  station.truth.gain[5] = 0.8;  // N of segment 2
  station.learns = true;
  station.run(6.0);
  const auto& found = station.observer.correction().segment;
  ModelCorrection sigma;
  station.observer.deviation(sigma);
  // A slow motion shows the ratio of area and k_a better than either.
  for (int i = 0; i < 2; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double is = (1.0 + found[k].axial_gain) / (1.0 + found[k].axial_stiffness);
    EXPECT_NEAR(is, i == 0 ? 1.0 / 1.2 : 0.8, 0.04) << i;
    EXPECT_LT(std::abs(found[k].axial_stiffness - (i == 0 ? 0.2 : 0.0)),
              4.0 * sigma.segment[k].axial_stiffness + 0.02);
    EXPECT_LT(std::abs(found[k].axial_gain - (i == 0 ? 0.0 : -0.2)),
              4.0 * sigma.segment[k].axial_gain + 0.02);
    EXPECT_LT(std::abs(found[k].gain), 4.0 * sigma.segment[k].gain + 0.02) << "as modelled";
  }
  ObserverReport report;
  station.observer.report(report);
  ASSERT_EQ(report.elongation_m.size(), 2);
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(report.elongation_m[i], station.truth.u[3 * i + 2], 5e-4);
    EXPECT_GT(report.elongation_deviation_m[i], 0.0);
    EXPECT_LT(report.elongation_deviation_m[i], 5e-4);
    EXPECT_EQ(report.deviation.segment[static_cast<std::size_t>(i)].axial_gain,
              sigma.segment[static_cast<std::size_t>(i)].axial_gain);
  }
  double e = 0.0;
  station.each_tick = [&] {
    for (const int j : {2, 5})
      e = std::max(e, std::abs(station.predicted.u_rad[j] - station.truth.u[j]));
  };
  station.run(1.0);
  EXPECT_LT(e, 3e-4);
}

TEST(ModelObserver, FindsStiffnessDampingGainAndLoad) {
  const ArmParameters arm = test::arm_of(2);
  ArmParameters real = arm;
  real.segments[0].stiffness_nm_per_rad *= 1.15;
  real.segments[1].damping_nms_per_rad *= 0.8;
  real.gravity_mps2 += Eigen::Vector3d(0.1 * 9.81, 0.0, 0.0);
  Station station(arm, real, observer_settings(1e-3));
  station.truth.gain.tail(2).setConstant(0.9);
  station.learns = true;
  EXPECT_LT(prediction_error(station, 15.0, 20.0), 6e-4);
  ModelCorrection sigma;
  station.observer.deviation(sigma);
  const auto& found = station.observer.correction().segment;
  const auto within = [](double estimate, double truth, double deviation) {
    EXPECT_LT(std::abs(estimate - truth), 4.0 * deviation + 0.01) << estimate << " " << truth;
    EXPECT_LT(deviation, 0.2);
  };
  within(found[0].stiffness, 0.15, sigma.segment[0].stiffness);
  within(found[1].stiffness, 0.0, sigma.segment[1].stiffness);
  within(found[0].damping, 0.0, sigma.segment[0].damping);
  within(found[1].damping, -0.2, sigma.segment[1].damping);
  within(found[0].gain, 0.0, sigma.segment[0].gain);
  within(found[1].gain, -0.1, sigma.segment[1].gain);
  for (std::size_t i = 0; i < 2; ++i) {
    within(found[i].load.x(), 0.1, sigma.segment[i].load.x());
    within(found[i].load.y(), 0.0, sigma.segment[i].load.y());
  }
}

/// Innovations and errors in units of their deviations, over seeds: arms drawn from the very priors
/// that the observer assumes.
void consistency(int seeds) {
  const ArmParameters arm = test::arm_of(2);
  EstimationSettings settings = observer_settings(3.5e-3);
  settings.base_is_fixed = true;
  ModelObserverSettings& model = settings.model_observer;
  model.parameter_deviation = 0.05;  // so small that the errors are linear
  model.parameter_drift_per_sqrt_s = 0.0;
  model.largest_disturbance_drift_per_sqrt_s = model.disturbance_drift_per_sqrt_s;
  double nis = 0.0;
  std::int64_t frames = 0;
  // u, u', d; stiffness, damping, gain, load
  std::array<double, 7> squares{};
  for (int seed = 1; seed <= seeds; ++seed) {
    std::mt19937 random(static_cast<unsigned>(1000 + seed));
    std::normal_distribution<double> normal(0.0, model.parameter_deviation);
    ArmParameters real = arm;
    std::array<SegmentCorrection, 2> drawn;
    for (std::size_t i = 0; i < 2; ++i) {
      drawn[i].stiffness = normal(random);
      drawn[i].damping = normal(random);
      drawn[i].gain = normal(random);
      real.segments[i].stiffness_nm_per_rad *= 1.0 + drawn[i].stiffness;
      real.segments[i].damping_nms_per_rad *= 1.0 + drawn[i].damping;
    }
    const Eigen::Vector2d load(normal(random), normal(random));
    real.gravity_mps2 += 9.81 * Eigen::Vector3d(load.x(), load.y(), 0.0);
    Station station(arm, real, settings, static_cast<unsigned>(seed));
    for (int j = 0; j < 4; ++j)
      station.truth.gain[j] = 1.0 + drawn[static_cast<std::size_t>(j / 2)].gain;
    station.truth.longest_step_s = 5e-4;
    station.truth.base_noise = false;
    station.learns = true;
    station.each_frame = [&] {
      for (int j = 0; j < 4; ++j) {
        const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(j / 2)];
        const double scale =
            segment.stiffness_nm_per_rad + 0.5 * 9.81 * segment.mass_kg * segment.length_m;
        station.truth.disturbance_nm[j] +=
            scale * model.disturbance_drift_per_sqrt_s * std::sqrt(5e-3) * station.truth.normal();
      }
      if (to_seconds(station.now_ns) < 0.5) return;
      nis += station.observer.nis();
      ++frames;
    };
    station.latency_ns = 0;  // the deviations are those at the frame
    station.run(2.0);
    FilteredMotion sigma;
    ModelCorrection deviation;
    station.observer.deviation(sigma);
    station.observer.deviation(deviation);
    const auto add = [&](std::size_t kind, double error, double by, double share) {
      squares[kind] += share * (error / by) * (error / by) / seeds;
    };
    station.observer.predict(station.now_ns, station.now_ns, station.predicted);
    const ModelCorrection& found = station.observer.correction();
    for (int j = 0; j < 4; ++j) {
      add(0, station.predicted.u_rad[j] - station.truth.u[j], sigma.u_rad[j], 0.25);
      add(1, station.predicted.velocity_radps[j] - station.truth.velocity[j],
          sigma.velocity_radps[j], 0.25);
      add(2, found.disturbance_nm[j] - station.truth.disturbance_nm[j], deviation.disturbance_nm[j],
          0.25);
    }
    for (std::size_t i = 0; i < 2; ++i) {
      add(3, found.segment[i].stiffness - drawn[i].stiffness, deviation.segment[i].stiffness, 0.5);
      add(4, found.segment[i].damping - drawn[i].damping, deviation.segment[i].damping, 0.5);
      add(5, found.segment[i].gain - drawn[i].gain, deviation.segment[i].gain, 0.5);
      for (int axis = 0; axis < 2; ++axis)
        add(6, found.segment[i].load[axis] - load[axis], deviation.segment[i].load[axis], 0.25);
    }
  }
  // The mean over all frames and components of a square whose mean is 1 and deviation sqrt(2).
  const double components = 4.0 * static_cast<double>(frames);
  EXPECT_NEAR(nis / static_cast<double>(frames), 1.0, 4.0 * std::sqrt(2.0 / components));
  // Components of one arm are not independent: as if there were two an arm.
  const double interval = 4.0 * std::sqrt(2.0 / (2.0 * seeds));
  const char* const names[] = {"u", "u'", "d", "stiffness", "damping", "gain", "load"};
  for (std::size_t kind = 0; kind < squares.size(); ++kind)
    EXPECT_NEAR(squares[kind], 1.0, interval) << names[kind];
}

TEST(ModelObserver, IsConsistentOverTenSeeds) { consistency(10); }
TEST(ModelObserverSlow, IsConsistentOverAHundredSeeds) { consistency(100); }

/// Frames of an arm at rest: no truth need be stepped, however stiff.
void holds_still(const ArmParameters& arm) {
  const int n = arm.size();
  const EstimationSettings settings = observer_settings(1e-3);
  ModelObserver observer(arm, settings, body_noise(settings, n), {.valve_lag_s = kLag_s});
  CurvatureEstimator estimator(settings, arm, body_noise(settings, n));
  FilteredMotion out;
  MocapFrame frame = test::frame_of(arm, Eigen::VectorXd::Zero(2 * n));
  CurvatureEstimate estimate;
  estimator.estimate(frame, estimate);
  for (std::int64_t k = 1; k <= 100; ++k) {
    frame.capture_ns = 5 * kMs * k;
    observer.update(frame, estimate, nullptr, false);
    observer.predict(frame.capture_ns, frame.capture_ns, out);
  }
  EXPECT_TRUE(observer.running()) << n;
  EXPECT_EQ(observer.failures(), 0) << n;
  EXPECT_LT(out.u_rad.norm(), 1e-6) << n;
  EXPECT_LT(out.velocity_radps.norm(), 1e-4) << n;
}

TEST(ModelObserver, FollowsArmsOfEveryLength) {
  for (const int n : {1, 2, 6, 7}) {
    ArmParameters arm = test::arm_of(n, 0.33 / n);
    for (SegmentParameters& segment : arm.segments) {
      segment.mass_kg = 0.45 / n;
      segment.damping_nms_per_rad = 0.02;
    }
    Station station(arm, arm, observer_settings(3.5e-3), 1, 0.4 / n);
    station.truth.longest_step_s = n > 3 ? 2e-5 : 1e-4;
    EXPECT_LT(prediction_error(station, 0.2, 0.5), 3e-3) << n;
    EXPECT_TRUE(station.observer.running()) << n;
    EXPECT_EQ(station.observer.failures(), 0) << n;
  }
  for (const int n : {10, 20}) holds_still(test::arm_of(n));
}

TEST(ModelObserver, FollowsPointMasses) {
  // The fastest mode of three point masses is 3.7e5 1/s: the truth is stepped two at a time only.
  ArmParameters arm = test::arm_of(2);
  arm.mass = MassModel::point;
  Station station(arm, arm, observer_settings(3.5e-3));
  station.truth.longest_step_s = 5e-5;
  EXPECT_LT(prediction_error(station, 0.3, 0.8), 2e-3);
  for (const int n : {3, 6, 20}) {
    ArmParameters stiff = test::arm_of(n);
    stiff.mass = MassModel::point;
    holds_still(stiff);
  }
}

TEST(ModelObserver, CrossesTheStraightPoseAndGoesBeyondPi) {
  ArmParameters arm = test::arm_of(1);
  arm.segments[0].mass_kg = 0.05;
  for (const double amplitude : {0.2, 3.8}) {
    Station station(arm, arm, observer_settings(3.5e-3), 1, amplitude);
    EXPECT_LT(prediction_error(station, 0.3, 3.0), 6e-3) << amplitude;
    EXPECT_EQ(station.observer.failures(), 0);
  }
}

TEST(ModelObserver, CoupleActuation) {
  ArmParameters arm = test::arm_of(2);
  arm.actuation = ActuationModel::couple;
  Station station(arm, arm, observer_settings(1e-6), 1, 0.6);
  EXPECT_LT(prediction_error(station, 0.3, 1.0), 2e-4);
}

TEST(ModelObserver, PredictsAnOccludedSegmentForSoManyFrames) {
  const ArmParameters arm = test::arm_of(3);
  EstimationSettings settings = observer_settings(3.5e-3);
  settings.predicted_frames = 5;
  Station station(arm, arm, settings);
  station.run(1.0);
  int hidden = 0;
  station.corrupt = [&](MocapFrame& frame) {
    frame.body[2].valid = false;  // bounds segments 2 and 3
    ++hidden;
    return true;
  };
  double worst = 0.0;
  station.each_tick = [&] {
    EXPECT_EQ(station.predicted.valid[1], hidden <= 5);
    EXPECT_TRUE(station.predicted.valid[0]);
    worst = std::max(worst, (station.predicted.u_rad - station.truth.u).cwiseAbs().maxCoeff());
  };
  station.run(0.1);
  EXPECT_GT(hidden, 15);
  EXPECT_LT(worst, 8e-3);
  station.corrupt = nullptr;
  station.each_tick = nullptr;
  station.run(0.1);
  EXPECT_TRUE(station.predicted.all_valid());
}

TEST(ModelObserver, LivesThroughSilenceAndStartsAgainAfterASecond) {
  const ArmParameters arm = test::arm_of(3);
  Station station(arm, arm, observer_settings(3.5e-3));
  station.run(1.0);
  FilteredMotion before, after;
  station.observer.deviation(before);
  station.corrupt = [](MocapFrame&) { return false; };
  double worst = 0.0;
  station.each_tick = [&] {
    worst = std::max(worst, (station.predicted.u_rad - station.truth.u).cwiseAbs().maxCoeff());
  };
  station.run(0.2);
  station.observer.deviation(after);
  EXPECT_LT(worst, 0.01);
  EXPECT_GT(after.u_rad[0], before.u_rad[0]);
  station.run(0.9);
  station.corrupt = nullptr;
  station.run(1.0);
  EXPECT_TRUE(station.observer.running());
  EXPECT_LT((station.predicted.u_rad - station.truth.u).cwiseAbs().maxCoeff(), 8e-3);
}

TEST(ModelObserver, IgnoresFramesThatAreNotLater) {
  const ArmParameters arm = test::arm_of(2);
  const EstimationSettings settings = observer_settings(3.5e-3);
  Station station(arm, arm, settings);
  station.run(0.5);
  ModelObserver& observer = station.observer;
  FilteredMotion before, after;
  observer.predict(station.now_ns, station.now_ns, before);
  MocapFrame old = test::frame_of(arm, Eigen::VectorXd::Constant(4, 1.0));
  CurvatureEstimate estimate;
  station.estimator.estimate(old, estimate);
  for (const std::int64_t ago_ns : {5 * kMs, 100 * kMs}) {
    old.capture_ns = station.now_ns - ago_ns;
    observer.update(old, estimate, nullptr, false);
  }
  observer.predict(station.now_ns, station.now_ns, after);
  EXPECT_EQ(before.u_rad, after.u_rad);
}

TEST(ModelObserver, ParametersStayWithoutAReference) {
  const ArmParameters arm = test::arm_of(2);
  ArmParameters real = arm;
  real.segments[0].stiffness_nm_per_rad *= 1.3;
  Station station(arm, real, observer_settings(3.5e-3));
  station.run(2.0);
  for (const SegmentCorrection& off : station.observer.correction().segment) {
    EXPECT_EQ(off.stiffness, 0.0);
    EXPECT_EQ(off.load, Eigen::Vector2d::Zero());
  }
  EXPECT_GT(station.observer.correction().disturbance_nm.norm(), 1e-3);
}

TEST(ModelObserver, APushIsASurpriseAndNoiseIsNone) {
  const ArmParameters arm = test::arm_of(3);
  Station station(arm, arm, observer_settings(3.5e-3));
  station.learns = true;
  bool surprised = false;
  station.each_frame = [&] { surprised |= station.observer.surprised(); };
  station.run(4.0);
  EXPECT_FALSE(surprised);
  const ModelCorrection before = station.observer.correction();
  station.truth.disturbance_nm.setConstant(0.1);
  station.run(0.1);
  EXPECT_TRUE(surprised);
  // The parameters have nothing to do with it: they stay within what was not known of them.
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(station.observer.correction().segment[i].stiffness, before.segment[i].stiffness,
                0.2);
}

TEST(ModelObserver, FailsIntoSilenceAndStartsAgain) {
  const ArmParameters arm = test::arm_of(2);
  Station station(arm, arm, observer_settings(3.5e-3));
  station.run(0.5);
  station.observer.command(station.now_ns,
                           Eigen::VectorXd::Constant(4, std::numeric_limits<double>::quiet_NaN()));
  station.run(0.02);
  EXPECT_GT(station.observer.failures(), 0);
  station.run(1.0);
  EXPECT_TRUE(station.observer.running());
  EXPECT_LT((station.predicted.u_rad - station.truth.u).cwiseAbs().maxCoeff(), 8e-3);
  EXPECT_TRUE(station.observer.correction().disturbance_nm.allFinite());
}

TEST(ModelObserver, AllocatesNothing) {
  const std::pair<int, bool> arms[] = {
      {3, false}, {20, false}, {128, false}, {3, true}, {20, true}};
  for (const auto& [n, stretches] : arms) {
    ArmParameters arm = test::arm_of(n, 0.33 / n);
    arm.extensible = stretches;
    const EstimationSettings settings = observer_settings(3.5e-3);
    ModelObserver observer(arm, settings, body_noise(settings, n), {.valve_lag_s = kLag_s});
    CurvatureEstimator estimator(settings, arm, body_noise(settings, n));
    MocapFrame frame = test::frame_of(arm, Eigen::VectorXd::Constant(arm.dof(), 0.3 / n));
    KnownMotion known;
    known.u_rad = known.velocity_radps = known.acceleration_radps2 =
        SegmentVector::Constant(arm.dof(), 0.3 / n);
    const SegmentVector tau = SegmentVector::Constant(arm.dof(), 0.01 / n);
    FilteredMotion out;
    ModelCorrection sigma;
    CurvatureEstimate estimate;
    estimator.estimate(frame, estimate);
    const long before = test::thread_allocations;
    for (std::int64_t k = 1; k <= (n > 100 ? 5 : 300); ++k) {
      frame.capture_ns = 5 * kMs * k;
      frame.body[1].valid = k % 7 != 0;
      estimate.valid[0] = frame.body[1].valid;
      observer.update(frame, estimate, k % 50 < 25 ? &known : nullptr, k % 3 != 0);
      observer.predict(frame.capture_ns + 5 * kMs, frame.capture_ns + 6 * kMs, out);
      observer.command(frame.capture_ns + 5 * kMs, tau);
      observer.deviation(sigma);
      observer.deviation(out);
    }
    EXPECT_EQ(test::thread_allocations - before, 0) << n;
  }
}

TEST(ModelObserver, RefusesSettingsThatMeanNothing) {
  const ArmParameters arm = test::arm_of(2);
  const auto refuses = [&](const std::function<void(ModelObserverSettings&)>& change) {
    EstimationSettings settings = observer_settings(1e-3);
    change(settings.model_observer);
    EXPECT_THROW(ModelObserver(arm, settings, body_noise(settings, 2), {}), std::invalid_argument);
  };
  refuses([](auto& s) { s.parameter_deviation = -1.0; });
  refuses([](auto& s) { s.disturbance_drift_per_sqrt_s = 0.0; });
  refuses([](auto& s) { s.largest_disturbance_drift_per_sqrt_s = 1e-9; });
}

}  // namespace
}  // namespace softarm
