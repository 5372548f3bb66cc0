#include "softarm/estimation/curvature_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {

constexpr double kBandwidth = 30.0;

EstimationSettings settings_of(double bandwidth = kBandwidth) {
  EstimationSettings settings;
  settings.filter_bandwidth_radps = bandwidth;
  return settings;
}

CurvatureEstimate estimate_of(double x, double y = 0.0) {
  CurvatureEstimate estimate;
  estimate.segments = 1;
  estimate.u_rad = Eigen::Vector2d(x, y);
  estimate.valid[0] = true;
  return estimate;
}

KnownMotion known_of(double u, double velocity, double acceleration, std::uint32_t source = 1) {
  KnownMotion known;
  known.u_rad = Eigen::Vector2d(u, 0.0);
  known.velocity_radps = Eigen::Vector2d(velocity, 0.0);
  known.acceleration_radps2 = Eigen::Vector2d(acceleration, 0.0);
  known.source = source;
  return known;
}

// Frames as they come: jitter in their times, some missing, some bunched.
std::vector<double> irregular_times(double duration, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform;
  std::vector<double> times;
  for (double t = 0.001; t < duration;) {
    times.push_back(t);
    const double kind = uniform(random);
    t += kind < 0.1 ? 1e-6 : kind < 0.2 ? 0.04 : 0.002 + 0.006 * uniform(random);
  }
  return times;
}

// The fit by its definition: all measurements since the start, dense weighted normal equations in
// long double.
struct BruteFit {
  long double u, velocity;
};
BruteFit brute_fit(const std::vector<double>& t, const std::vector<double>& y, double at) {
  using Matrix = Eigen::Matrix<long double, 3, 3>;
  using Vector = Eigen::Matrix<long double, 3, 1>;
  Matrix M = Matrix::Zero();
  Vector r = Vector::Zero();
  const long double w = kBandwidth;
  const auto add = [&](long double age, long double weight, long double value) {
    const Vector b(1.0L, -age, age * age / 2.0L);
    M += weight * b * b.transpose();
    r += weight * value * b;
  };
  const long double now = t.back();
  for (std::size_t k = 1; k < t.size(); ++k) add(now - t[k], std::exp(-w * (now - t[k])), y[k]);
  // The first frame stands for a rest before it: one frame's weight, spread as w exp(-w age).
  constexpr int kSteps = 20000;
  const long double step = 50.0L / w / kSteps;
  for (int k = 0; k < kSteps; ++k) {
    const long double age = (k + 0.5L) * step + (now - t.front());
    add(age, w * step * std::exp(-w * age), y.front());
  }
  const Vector c = M.ldlt().solve(r);
  const long double h = at - now;
  return {c[0] + h * c[1] + h * h / 2.0L * c[2], c[1] + h * c[2]};
}

TEST(CurvatureFilter, IsTheWeightedFitOfAllMeasurements) {
  CurvatureFilter filter(settings_of(), 1);
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise;
  std::vector<double> t, y;
  for (const double time : irregular_times(0.6, 2)) {
    t.push_back(to_seconds(to_ns(time)));
    y.push_back(std::sin(4.0 * time) + 0.05 * noise(random));
    filter.update(to_ns(time), estimate_of(y.back(), -y.back()));
    FilteredMotion motion;
    filter.predict(to_ns(time) + to_ns(0.008), motion);
    const BruteFit fit = brute_fit(t, y, t.back() + 0.008);
    ASSERT_TRUE(motion.valid[0]);
    EXPECT_NEAR(motion.u_rad[0], static_cast<double>(fit.u), 2e-6) << "after " << t.size();
    EXPECT_NEAR(motion.velocity_radps[0], static_cast<double>(fit.velocity), 2e-4);
    EXPECT_DOUBLE_EQ(motion.u_rad[1], -motion.u_rad[0]);
  }
}

// Largest errors of u and u' from `from` on, at instants 7 ms after every frame.
struct Errors {
  double u = 0.0, velocity = 0.0;
};
Errors track(const std::vector<double>& times, double from,
             const std::function<std::array<double, 3>(double)>& truth, bool with_known,
             double bandwidth = kBandwidth) {
  CurvatureFilter filter(settings_of(bandwidth), 1);
  Errors errors;
  for (const double time : times) {
    const auto [u, velocity, acceleration] = truth(time);
    const KnownMotion known = known_of(u, velocity, acceleration);
    filter.update(to_ns(time), estimate_of(u), with_known ? &known : nullptr);
    if (time < from) continue;
    const auto later = truth(time + 0.007);
    const KnownMotion known_later = known_of(later[0], later[1], later[2]);
    FilteredMotion motion;
    filter.predict(to_ns(time + 0.007), motion, with_known ? &known_later : nullptr);
    errors.u = std::max(errors.u, std::abs(motion.u_rad[0] - later[0]));
    errors.velocity = std::max(errors.velocity, std::abs(motion.velocity_radps[0] - later[1]));
  }
  return errors;
}

TEST(CurvatureFilter, QuadraticMotionPassesWithoutLag) {
  const auto quadratic = [](double t) {
    return std::array<double, 3>{0.3 - 1.2 * t + 0.7 * t * t, -1.2 + 1.4 * t, 1.4};
  };
  const Errors errors = track(irregular_times(3.0, 5), 1.5, quadratic, false);
  EXPECT_LT(errors.u, 5e-9);  // times are whole nanoseconds
  EXPECT_LT(errors.velocity, 5e-7);
}

// The documented lag behind a jerk: u by j / w^3, u' by 3 j / w^2 (at the newest frame, frames
// close together).
TEST(CurvatureFilter, LagBehindAJerkIsAsDocumented) {
  CurvatureFilter filter(settings_of(), 1);
  const double jerk = 12.0;
  const auto u = [&](double t) { return jerk * t * t * t / 6.0; };
  FilteredMotion motion;
  for (int k = 0; k <= 20000; ++k) filter.update(to_ns(1e-4 * k), estimate_of(u(1e-4 * k)));
  filter.predict(to_ns(2.0), motion);
  const double w = kBandwidth;
  EXPECT_NEAR((u(2.0) - motion.u_rad[0]) / (jerk / (w * w * w)), 1.0, 0.02);
  EXPECT_NEAR((jerk * 2.0 - motion.velocity_radps[0]) / (3.0 * jerk / (w * w)), 1.0, 0.02);
}

TEST(CurvatureFilter, FollowsASineIrregularFramesOrNot) {
  const auto sine = [](double t) {
    const double w = 2.0;  // the paper's reference turns at 2 rad/s
    return std::array<double, 3>{0.4 * std::sin(w * t), 0.4 * w * std::cos(w * t),
                                 -0.4 * w * w * std::sin(w * t)};
  };
  const Errors errors = track(irregular_times(6.0, 6), 1.0, sine, false);
  EXPECT_LT(errors.u, 0.8e-3);
  EXPECT_LT(errors.velocity, 30e-3);
}

TEST(CurvatureFilter, AKnownMotionPassesExactlyHoweverSlowTheFilter) {
  const auto fast = [](double t) {
    return std::array<double, 3>{std::sin(20.0 * t), 20.0 * std::cos(20.0 * t),
                                 -400.0 * std::sin(20.0 * t)};
  };
  const Errors without = track(irregular_times(3.0, 6), 0.5, fast, false, 5.0);
  EXPECT_GT(without.u, 0.3);
  const Errors with = track(irregular_times(3.0, 6), 0.0, fast, true, 5.0);
  EXPECT_LT(with.u, 1e-7);
  EXPECT_LT(with.velocity, 1e-5);
}

// Handing over from one known motion to another, to none and back leaves the estimate of a smooth
// motion alone.
TEST(CurvatureFilter, ChangingTheKnownMotionCarriesTheMemoryOver) {
  CurvatureFilter plain(settings_of(), 1);
  CurvatureFilter changing(settings_of(), 1);
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise;
  double worst_u = 0.0, worst_velocity = 0.0;
  for (int k = 0; k < 600; ++k) {
    const double t = 0.005 * k;
    const CurvatureEstimate estimate = estimate_of(std::sin(2.0 * t) + 0.005 * noise(random));
    plain.update(to_ns(t), estimate);
    const std::uint32_t source = static_cast<std::uint32_t>(k / 40) % 4;
    const KnownMotion known = source == 1 ? known_of(5.0 - 3.0 * t, -3.0, 0.0, 1)
                                          : known_of(t * t - 9.0, 2.0 * t, 2.0, source);
    changing.update(to_ns(t), estimate, source == 0 ? nullptr : &known);
    FilteredMotion one, other;
    plain.predict(to_ns(t + 0.006), one);
    changing.predict(to_ns(t + 0.006), other);  // carries the known motion on by itself
    worst_u = std::max(worst_u, std::abs(one.u_rad[0] - other.u_rad[0]));
    worst_velocity =
        std::max(worst_velocity, std::abs(one.velocity_radps[0] - other.velocity_radps[0]));
  }
  EXPECT_LT(worst_u, 1e-9);
  EXPECT_LT(worst_velocity, 1e-7);
}

TEST(CurvatureFilter, NoiseIsAsDocumented) {
  struct Case {
    double bandwidth, period, horizon;
  };
  for (const Case& c : {Case{30.0, 0.005, 0.0}, Case{30.0, 0.005, 0.0075}, Case{10.0, 0.005, 0.0},
                        Case{60.0, 0.001, 0.002}}) {
    CurvatureFilter filter(settings_of(c.bandwidth), 1);
    std::mt19937_64 random(17);
    std::normal_distribution<double> noise;
    Eigen::Array2d sum = Eigen::Array2d::Zero();
    constexpr int kSamples = 60000;
    for (int k = 0; k < kSamples + 1000; ++k) {
      filter.update(to_ns(c.period * k), estimate_of(noise(random), noise(random)));
      FilteredMotion motion;
      filter.predict(to_ns(c.period * k + c.horizon), motion);
      if (k < 1000) continue;
      sum[0] += motion.u_rad.squaredNorm() / (2.0 * kSamples);
      sum[1] += motion.velocity_radps.squaredNorm() / (2.0 * kSamples);
    }
    const FilterNoise expected = filter_noise(c.bandwidth, c.period, c.horizon);
    EXPECT_NEAR(std::sqrt(sum[0]) / expected.u, 1.0, 0.04);
    EXPECT_NEAR(std::sqrt(sum[1]) / expected.velocity_per_s, 1.0, 0.04);
  }
}

// Morrison's closed forms for the second-degree fading memory, and their limit in the header.
TEST(CurvatureFilter, NoiseAgreesWithTheTextbook) {
  for (const double period : {1e-5, 1e-3, 5e-3, 0.02}) {
    const double b = std::exp(-kBandwidth * period);
    const FilterNoise noise = filter_noise(kBandwidth, period, 0.0);
    const double u2 = (1 - b) * (1 + b * (6 + b * (16 + b * (24 + b * 19)))) / std::pow(1 + b, 5);
    const double v2 =
        std::pow(1 - b, 3) * (13 + b * (50 + b * 49)) / (2 * period * period * std::pow(1 + b, 5));
    EXPECT_NEAR(noise.u * noise.u / u2, 1.0, 1e-9);
    EXPECT_NEAR(noise.velocity_per_s * noise.velocity_per_s / v2, 1.0, 1e-9);
  }
  const FilterNoise limit = filter_noise(kBandwidth, 1e-5, 0.0);
  EXPECT_NEAR(limit.u / std::sqrt(33.0 / 16.0 * kBandwidth * 1e-5), 1.0, 1e-3);
  EXPECT_NEAR(limit.velocity_per_s / std::sqrt(7.0 / 4.0 * std::pow(kBandwidth, 3) * 1e-5), 1.0,
              1e-3);
}

TEST(CurvatureFilter, StartsAtRestAndConverges) {
  CurvatureFilter filter(settings_of(), 1);
  FilteredMotion motion;
  filter.predict(0, motion);
  EXPECT_FALSE(motion.all_valid());
  filter.update(to_ns(1.0), estimate_of(0.2));
  filter.predict(to_ns(1.01), motion);
  EXPECT_TRUE(motion.all_valid());
  EXPECT_DOUBLE_EQ(motion.u_rad[0], 0.2);
  EXPECT_DOUBLE_EQ(motion.velocity_radps[0], 0.0);
  for (int k = 1; k <= 80; ++k) filter.update(to_ns(1.0 + 0.005 * k), estimate_of(0.2 + 0.005 * k));
  filter.predict(to_ns(1.4), motion);
  EXPECT_NEAR(motion.u_rad[0], 0.6, 1e-4);
  EXPECT_NEAR(motion.velocity_radps[0], 1.0, 5e-3);
}

TEST(CurvatureFilter, IgnoresTimesThatDoNotAdvance) {
  CurvatureFilter filter(settings_of(), 1);
  filter.update(to_ns(1.0), estimate_of(0.2));
  filter.update(to_ns(1.0), estimate_of(0.9));
  filter.update(to_ns(0.9), estimate_of(0.9));
  FilteredMotion motion;
  filter.predict(to_ns(1.0), motion);
  EXPECT_DOUBLE_EQ(motion.u_rad[0], 0.2);
  EXPECT_EQ(filter.newest_ns(), to_ns(1.0));
}

TEST(CurvatureFilter, PredictsAnOccludedSegmentForAFewFramesOnly) {
  EstimationSettings settings = settings_of();
  settings.predicted_frames = 3;
  CurvatureFilter filter(settings, 2);
  CurvatureEstimate both;
  both.segments = 2;
  both.u_rad.resize(4);
  FilteredMotion motion;
  int k = 0;
  const auto next = [&](bool second_seen) {
    const double u = 0.005 * k;  // 1 rad/s
    both.u_rad << u, 0.0, 0.0, u;
    both.valid[0] = true;
    both.valid[1] = second_seen;
    if (!second_seen) both.u_rad.tail<2>().setConstant(99.0);
    filter.update(to_ns(0.005 * k), both);
    filter.predict(to_ns(0.005 * k), motion);
    return 0.005 * k++;
  };
  for (int i = 0; i < 200; ++i) next(true);
  for (int i = 0; i < 3; ++i) {
    const double u = next(false);
    ASSERT_TRUE(motion.valid[1]);
    EXPECT_NEAR(motion.u_rad[3], u, 1e-9);
    EXPECT_NEAR(motion.velocity_radps[3], 1.0, 1e-6);
  }
  next(false);
  EXPECT_TRUE(motion.valid[0]);
  EXPECT_FALSE(motion.valid[1]);
  EXPECT_FALSE(motion.all_valid());
  EXPECT_TRUE(motion.u_rad.tail<2>().isZero(0.0));
  const double u = next(true);
  EXPECT_TRUE(motion.all_valid());
  EXPECT_DOUBLE_EQ(motion.u_rad[3], u);  // from rest again
  EXPECT_DOUBLE_EQ(motion.velocity_radps[3], 0.0);
}

TEST(CurvatureFilter, StartsAgainAfterALongGapAndBoundsItsPrediction) {
  CurvatureFilter filter(settings_of(), 1);
  FilteredMotion motion, later;
  for (int k = 0; k <= 200; ++k) filter.update(to_ns(0.005 * k), estimate_of(0.01 * k));
  const double reach = filter.reset_gap_s() / 2.0;
  filter.predict(to_ns(1.0 + reach), motion);
  EXPECT_NEAR(motion.u_rad[0], 2.0 + 2.0 * reach, 1e-6);
  filter.predict(to_ns(1000.0), later);
  EXPECT_NEAR(later.u_rad[0], motion.u_rad[0], 1e-9);
  filter.update(to_ns(1.01 + filter.reset_gap_s()), estimate_of(-0.7));
  filter.predict(to_ns(1.02 + filter.reset_gap_s()), motion);
  EXPECT_DOUBLE_EQ(motion.u_rad[0], -0.7);
  EXPECT_DOUBLE_EQ(motion.velocity_radps[0], 0.0);
  filter.reset();
  filter.predict(to_ns(1.02), motion);
  EXPECT_FALSE(motion.all_valid());
}

// Years of frames, or one every nanosecond, or no weight left in an unseen segment: always finite.
TEST(CurvatureFilter, StaysFinite) {
  EstimationSettings settings = settings_of();
  settings.predicted_frames = 1'000'000;
  CurvatureFilter filter(settings, 1);
  FilteredMotion motion;
  std::int64_t t = 0;
  for (int k = 0; k < 200'000; ++k) {
    t += k % 3 == 0 ? 1 : k % 3 == 1 ? 130'000'000 : 17;
    CurvatureEstimate estimate = estimate_of(1.0, -2.0);
    estimate.valid[0] = (k / 1000) % 2 == 0;
    filter.update(t, estimate);
    filter.predict(t + 50'000'000, motion);
    ASSERT_TRUE(motion.u_rad.allFinite() && motion.velocity_radps.allFinite());
    if (motion.valid[0]) {
      ASSERT_NEAR(motion.u_rad[0], 1.0, 1e-4);
    }
  }
}

/// An arm of one segment that stretches, and what a frame says of it.
ArmParameters stretching_arm() {
  ArmParameters arm;
  arm.segments.resize(1);
  arm.extensible = true;
  return arm;
}
CurvatureEstimate stretched(double u, double elongation_m) {
  CurvatureEstimate estimate = estimate_of(u);
  estimate.length_m[0] = SegmentParameters{}.length_m + elongation_m;
  estimate.length_variance_m2[0] = 1e-8;
  return estimate;
}

// With numbers that u has too, e is bit for bit what u is: the same fit.
TEST(CurvatureFilter, ElongationIsFittedAsUIs) {
  CurvatureFilter filter(settings_of(), stretching_arm());
  const double rest_m = SegmentParameters{}.length_m;
  for (const double time : irregular_times(0.5, 4)) {
    const double u = 0.4 * std::sin(4.0 * time);
    // What the length at rest plus u rounds to.
    const double e = (rest_m + u) - rest_m;
    filter.update(to_ns(time), stretched(e, u));
    FilteredMotion motion;
    filter.predict(to_ns(time + 0.006), motion);
    ASSERT_EQ(motion.u_rad.size(), 3);
    EXPECT_DOUBLE_EQ(motion.u_rad[2], motion.u_rad[0]);
    EXPECT_NEAR(motion.velocity_radps[2], motion.velocity_radps[0], 1e-12);
  }
}

TEST(CurvatureFilter, AKnownElongationPassesExactly) {
  CurvatureFilter filter(settings_of(1.0), stretching_arm());
  KnownMotion known;
  const auto at = [&](double t) -> const KnownMotion& {
    known.u_rad = Eigen::Vector3d(0.1 * t, 0.0, 0.01 * std::sin(5.0 * t));
    known.velocity_radps = Eigen::Vector3d(0.1, 0.0, 0.05 * std::cos(5.0 * t));
    known.acceleration_radps2 = Eigen::Vector3d(0.0, 0.0, -0.25 * std::sin(5.0 * t));
    known.source = 1;
    return known;
  };
  FilteredMotion motion;
  for (double t = 0.0; t < 1.0; t += 0.005) {
    filter.update(to_ns(t), stretched(at(t).u_rad[0], at(t).u_rad[2]), &at(t));
    filter.predict(to_ns(t + 0.004), motion, &at(t + 0.004));
    EXPECT_NEAR(motion.u_rad[2], at(t + 0.004).u_rad[2], 1e-12);
    EXPECT_NEAR(motion.velocity_radps[2], at(t + 0.004).velocity_radps[2], 1e-12);
  }
}

TEST(CurvatureFilter, ALengthThatSaysNothingIsNoObservation) {
  EstimationSettings settings = settings_of();
  settings.predicted_frames = 1;
  CurvatureFilter filter(settings, stretching_arm());
  FilteredMotion motion;
  for (int k = 1; k <= 5; ++k) {
    CurvatureEstimate estimate = stretched(0.1, 0.01);
    if (k > 2) estimate.length_variance_m2[0] = std::numeric_limits<double>::infinity();
    filter.update(to_ns(0.005 * k), estimate);
    filter.predict(to_ns(0.005 * k), motion);
    EXPECT_EQ(motion.all_valid(), k <= 3) << k;
  }
}

TEST(CurvatureFilter, RefusesWrongSettings) {
  EXPECT_THROW(CurvatureFilter(settings_of(0.0), 1), std::invalid_argument);
  EXPECT_THROW(CurvatureFilter(settings_of(), 0), std::invalid_argument);
  EXPECT_THROW(CurvatureFilter(settings_of(), kMaxSegments + 1), std::invalid_argument);
  EstimationSettings settings = settings_of();
  settings.predicted_frames = -1;
  EXPECT_THROW(CurvatureFilter(settings, 1), std::invalid_argument);
}

}  // namespace
}  // namespace softarm
