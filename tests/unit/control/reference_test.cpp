#include "softarm/control/reference.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>

#include "unit/control/arms.hpp"

namespace softarm {
namespace {

using Eigen::VectorXd;
using std::numbers::pi;

ReferenceSettings one(ReferenceKind kind) { return {{{std::move(kind), 0.0}}}; }

WayPointReference way() {
  return {{{0.5, {0.0, 0.0, 0.1, 0.0}}, {1.5, {0.8, -0.3, 0.0, 0.4}}, {2.0, {0.5, 0.5, 0.2, 0.2}}},
          false};
}

ReferenceSettings sequence() {
  return {{{SetPointReference{{0.3, 0.1, -0.2, 0.0}}, 1.3},
           {PaperReference{}, 2.1},
           {way(), 1.7},
           {LiveReference{}, 1.0},
           {SetPointReference{{-0.3, 0.4, 0.0, 0.9}}, 0.0}}};
}

/// u' is the derivative of u and u'' that of u' at random times, judged by their integrals over a
/// short while. u'' may jump at `corners`.
void check_derivatives(const Reference& reference, double from, double to,
                       const std::vector<double>& corners, unsigned seed) {
  test::Random random(seed);
  constexpr double kShort = 1e-3;
  for (int trial = 0; trial < 2000; ++trial) {
    const double t = random.uniform(from, to);
    bool corner = false;
    for (double c : corners) corner |= t <= c && c <= t + kShort;
    const ReferenceSample a = test::sampled(reference, t),
                          m = test::sampled(reference, t + 0.5 * kShort),
                          b = test::sampled(reference, t + kShort);
    const VectorXd way = kShort / 6.0 * (a.velocity + 4.0 * m.velocity + b.velocity);
    EXPECT_LT((b.u - a.u - way).lpNorm<Eigen::Infinity>(), corner ? 3e-6 : 1e-10) << t;
    if (corner) continue;
    const VectorXd gain = kShort / 6.0 * (a.acceleration + 4.0 * m.acceleration + b.acceleration);
    EXPECT_LT((b.velocity - a.velocity - gain).lpNorm<Eigen::Infinity>(), 1e-8) << t;
  }
}

void expect_same_motion(const ReferenceSample& a, const ReferenceSample& b, double tolerance) {
  EXPECT_LT((a.u - b.u).lpNorm<Eigen::Infinity>(), tolerance);
  EXPECT_LT((a.velocity - b.velocity).lpNorm<Eigen::Infinity>(), tolerance);
}

TEST(Reference, PaperReferenceIs24) {
  Reference reference(one(PaperReference{}), test::gains(3, 1.0, 0.0), 3);
  reference.start(100.0, VectorXd::Zero(6), VectorXd::Zero(6));
  for (double t = 0.0; t < 5.0; t += 0.0137) {
    const ReferenceSample sample = test::sampled(reference, 100.0 + t);
    EXPECT_TRUE(sample.has_polar);
    EXPECT_FALSE(sample.limited);
    const double theta = t <= 1.0 ? 0.2 - 0.2 * std::cos(pi * t) : 0.4;
    for (int i = 0; i < 3; ++i) {
      const double phi = pi + std::cos(2.0 * t + i * pi / 3.0);
      EXPECT_NEAR(sample.polar[2 * i], phi, 1e-12);
      EXPECT_NEAR(sample.polar[2 * i + 1], theta, 1e-12);
      EXPECT_NEAR(sample.u[2 * i], theta * std::cos(phi), 1e-12);
      EXPECT_NEAR(sample.u[2 * i + 1], theta * std::sin(phi), 1e-12);
    }
  }
  check_derivatives(reference, 100.0, 105.0, {101.0}, 1);
}

TEST(Reference, PolarDerivativesAreThoseOfTheAngles) {
  Reference reference(one(PaperReference{}), test::gains(3, 1.0, 0.0), 3);
  reference.start(0.0, VectorXd::Zero(6), VectorXd::Zero(6));
  for (double t : {0.0, 0.3, 0.7, 1.5, 3.0}) {
    const double h = 1e-4;
    const ReferenceSample a = test::sampled(reference, t), b = test::sampled(reference, t + h),
                          c = test::sampled(reference, t + 2.0 * h);
    EXPECT_LT(((c.polar - a.polar) / (2.0 * h) - b.polar_velocity).norm(), 1e-6);
    EXPECT_LT(((c.polar_velocity - a.polar_velocity) / (2.0 * h) - b.polar_acceleration).norm(),
              1e-6);
  }
}

TEST(Reference, JoinedFromAnywhereItMeetsTheCurveAfterTheBlend) {
  test::Random random(2);
  Reference joined(one(PaperReference{}), test::gains(2, 1.0, 0.0), 2);
  Reference plain(one(PaperReference{}), test::gains(2, 1.0, 0.0), 2);
  plain.start(0.0, VectorXd::Zero(4), VectorXd::Zero(4));
  for (int trial = 0; trial < 50; ++trial) {
    const VectorXd u = random.vector(4, 1.0), velocity = random.vector(4, 2.0);
    joined.start(7.0, u, velocity);
    const ReferenceSample first = test::sampled(joined, 7.0);
    EXPECT_LT((first.u - u).norm(), 1e-14);
    EXPECT_LT((first.velocity - velocity).norm(), 1e-14);
    EXPECT_FALSE(first.has_polar);
    expect_same_motion(test::sampled(joined, 6.5), first,
                       1e-15);  // before the start: as at the start
    for (double t : {8.0, 8.3, 11.0}) {
      const ReferenceSample a = test::sampled(joined, t), b = test::sampled(plain, t - 7.0);
      expect_same_motion(a, b, 1e-13);
      EXPECT_LT((a.acceleration - b.acceleration).norm(), 1e-12);
      EXPECT_TRUE(a.has_polar);
    }
    check_derivatives(joined, 7.0, 10.0, {8.0}, static_cast<unsigned>(trial));
    if (HasFailure()) return;
  }
}

TEST(Reference, ABlendTakesLongerWhereTheSpeedLimitAsks) {
  ControllerSettings control = test::gains(1, 1.0, 0.0);
  control.max_speed_radps = 0.5;
  control.blend_s = 0.1;
  Reference reference(one(SetPointReference{{1.0, 0.0}}), control, 1);
  reference.start(0.0, Eigen::Vector2d(-1.0, 0.0), VectorXd::Zero(2));
  double fastest = 0.0;
  for (double t = 0.0; t < 10.0; t += 0.01) {
    const ReferenceSample sample = test::sampled(reference, t);
    fastest = std::max(fastest, sample.velocity.norm());
    EXPECT_FALSE(sample.limited);
  }
  EXPECT_NEAR(fastest, 0.5, 1e-3);
  EXPECT_NEAR(test::sampled(reference, 7.6).u[0], 1.0, 1e-12);  // 1.875 * 2 rad / 0.5 rad/s = 7.5 s
}

TEST(Reference, WayPointsArePassedAtRest) {
  Reference reference(one(way()), test::gains(2, 1.0, 0.0), 2);
  const WayPointReference points = way();
  reference.start(0.0, Eigen::Vector4d(0.0, 0.0, 0.1, 0.0), VectorXd::Zero(4));
  for (const WayPoint& point : points.points) {
    const ReferenceSample sample = test::sampled(reference, point.time_s);
    for (int i = 0; i < 4; ++i) {
      EXPECT_NEAR(sample.u[i], point.u_rad[static_cast<std::size_t>(i)], 1e-14);
    }
    EXPECT_LT(sample.velocity.norm() + sample.acceleration.norm(), 1e-12);
  }
  EXPECT_EQ(test::sampled(reference, 0.2).velocity.norm(), 0.0);
  EXPECT_EQ(test::sampled(reference, 9.0).velocity.norm(), 0.0);
  check_derivatives(reference, 0.0, 3.0, {0.5, 1.5, 2.0}, 3);
}

TEST(Reference, WayPointsRepeat) {
  WayPointReference round = way();
  round.points.push_back({3.0, round.points.front().u_rad});
  round.repeat = true;
  Reference reference(one(round), test::gains(2, 1.0, 0.0), 2);
  reference.start(0.0, Eigen::Vector4d(0.0, 0.0, 0.1, 0.0), VectorXd::Zero(4));
  for (double t = 0.6; t < 3.0; t += 0.05) {
    expect_same_motion(test::sampled(reference, t), test::sampled(reference, t + 4.0 * 2.5), 1e-12);
  }
  check_derivatives(reference, 2.5, 6.0, {3.0, 4.0, 4.5, 5.5}, 4);
}

TEST(Reference, PhasesFollowEachOtherSmoothly) {
  Reference reference(sequence(), test::gains(2, 1.0, 0.0), 2);
  reference.start(0.0, Eigen::Vector4d(0.5, 0.5, -0.5, 0.1), Eigen::Vector4d(0.3, 0.0, 0.0, -1.0));
  // Phases begin at 1.3, 3.4, 5.1 and 6.1 s; blends end a second later; (24) has its corner 1 s
  // after its beginning.
  const std::vector<double> corners{1.0, 1.3, 2.3, 3.4, 3.9, 4.4, 4.9, 5.1, 5.4, 6.1, 7.1};
  check_derivatives(reference, 0.0, 8.0, corners, 5);
  for (double t : {1.3, 3.4, 5.1, 6.1}) {
    expect_same_motion(test::sampled(reference, t - 1e-9), test::sampled(reference, t), 1e-7);
  }
  EXPECT_NEAR(test::sampled(reference, 1.2).u[0], 0.3, 1e-12);
  EXPECT_NEAR(test::sampled(reference, 4.9).u[0], 0.8, 1e-12);  // way point at 3.4 + 1.5
  EXPECT_NEAR(test::sampled(reference, 99.0).u[3], 0.9, 1e-12);
  // A function of time: asking in any order gives the same.
  const ReferenceSample once = test::sampled(reference, 2.0);
  test::sampled(reference, 7.0);
  expect_same_motion(once, test::sampled(reference, 2.0), 0.0 + 1e-300);
}

TEST(Reference, StartsAgainAfterHold) {
  Reference reference(sequence(), test::gains(2, 1.0, 0.0), 2);
  EXPECT_FALSE(reference.started());
  reference.start(0.0, VectorXd::Zero(4), VectorXd::Zero(4));
  EXPECT_TRUE(reference.started());
  test::sampled(reference, 4.0);
  const VectorXd u = VectorXd::Constant(4, 0.7);
  reference.start(50.0, u, VectorXd::Zero(4));
  EXPECT_LT((test::sampled(reference, 50.0).u - u).norm(), 1e-15);
  EXPECT_NEAR(test::sampled(reference, 51.2).u[0], 0.3, 1e-12);  // the first phase again
}

TEST(Reference, WindowDoesNotReachOverTheStart) {
  Reference reference(one(PaperReference{}), test::gains(2, 1.0, 0.0), 2);
  reference.start(10.0, VectorXd::Zero(4), VectorXd::Zero(4));
  ReferenceWindow window;
  reference.window(10.0, 0.01, window);
  EXPECT_NEAR(window.interval_s, 0.01, 1e-12);
  reference.window(10.004, 0.01, window);
  EXPECT_NEAR(window.interval_s, 0.014, 1e-12);
  reference.window(12.0, 0.01, window);
  EXPECT_NEAR(window.interval_s, 0.02, 1e-12);
  EXPECT_EQ((window.after.u - test::sampled(reference, 12.01).u).norm(), 0.0);
  EXPECT_EQ((window.before.u - test::sampled(reference, 11.99).u).norm(), 0.0);
  reference.window(12.0, 0.0, window);
  EXPECT_EQ(window.interval_s, 0.0);
}

TEST(Reference, SoftLimitBendsThetaWithExactDerivatives) {
  // Thrown outwards: the blend alone would leave the disc of 0.5 rad.
  ControllerSettings control = test::gains(2, 1.0, 0.0);
  control.max_theta_rad = 0.5;
  Reference reference(one(SetPointReference{{0.3, 0.3, 0.0, 0.0}}), control, 2);
  reference.start(0.0, Eigen::Vector4d(0.3, 0.3, 0.0, 0.0), Eigen::Vector4d(1.2, 0.2, 0.0, 0.1));
  bool limited = false;
  for (double t = 0.0; t < 1.0; t += 0.001) {
    const ReferenceSample sample = test::sampled(reference, t);
    EXPECT_LT(sample.u.head<2>().norm(), 0.5);
    limited |= sample.limited;
  }
  EXPECT_TRUE(limited);
  EXPECT_FALSE(test::sampled(reference, 1.0).limited);
  test::Random random(6);
  for (int trial = 0; trial < 1000; ++trial) {
    const double t = random.uniform(0.01, 0.95), h = 1e-5;
    const ReferenceSample a = test::sampled(reference, t - h), m = test::sampled(reference, t),
                          b = test::sampled(reference, t + h);
    EXPECT_LT(((b.u - a.u) / (2.0 * h) - m.velocity).norm(), 2e-4);
    EXPECT_LT(((b.velocity - a.velocity) / (2.0 * h) - m.acceleration).norm(), 0.1);  // C2 only
  }
}

TEST(Reference, RefusesWhatDoesNotFit) {
  const ControllerSettings control = test::gains(2, 1.0, 0.0);
  const auto refused = [&](const ReferenceSettings& settings, int segments = 2) {
    try {
      Reference reference(settings, control, segments);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refused(sequence()), "");
  EXPECT_NE(refused({}), "");
  EXPECT_NE(refused(sequence(), 3).find("reference[0]: expected u of 6 numbers"),
            std::string::npos);
  EXPECT_NE(refused(sequence(), 0), "");
  EXPECT_NE(refused(sequence(), 65), "");
  EXPECT_NE(refused(one(SetPointReference{{3.0, 0.0, 0.0, 0.0}})).find("max_theta"),
            std::string::npos);
  EXPECT_NE(refused(one(SetPointReference{{NAN, 0.0, 0.0, 0.0}})), "");
  PaperReference fast;
  fast.rate_radps = 200.0;
  EXPECT_NE(refused(one(fast)).find("max_speed"), std::string::npos);
  WayPointReference bad = way();
  bad.points[1].time_s = 0.2;
  EXPECT_NE(refused(one(bad)).find("reference[0].points[1].time_s: expected later"),
            std::string::npos);
  bad = way();
  bad.repeat = true;
  EXPECT_NE(refused(one(bad)).find("equal the first"), std::string::npos);
  bad.points.clear();
  EXPECT_NE(refused(one(bad)), "");
  bad = way();
  bad.points[1].time_s = 0.51;
  EXPECT_NE(refused(one(bad)).find("max_speed"), std::string::npos);
  ReferenceSettings settings = sequence();
  settings.phases[0].duration_s = 0.0;
  EXPECT_NE(refused(settings).find("duration"), std::string::npos);
  EXPECT_NE(refused(one(LiveReference{-1.0})), "");
  EXPECT_DOUBLE_EQ(largest_theta_rad(sequence()), std::hypot(0.8, 0.3) > 0.9 ? 0.0 : 0.9);
}

}  // namespace
}  // namespace softarm
