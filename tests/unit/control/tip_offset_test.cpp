// The offset of the measured tip: what depends on the place is learnt, what does not is not made up.
#include "control/tip_offset.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "counted_malloc.hpp"

namespace softarm {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kFrame_s = 0.005, kReach_m = 0.33;

/// A circle of 5 cm below the base.
TipReference circle(double time_s, double rate) {
  const double c = std::cos(rate * time_s), s = std::sin(rate * time_s), r = 0.05;
  return {Vector3d(r * c, r * s, -0.28), r * rate * Vector3d(-s, c, 0.0),
          -r * rate * rate * Vector3d(c, s, 0.0)};
}

/// What a wrong length and a load do to the tip.
Vector3d offset_of(const Vector3d& path_m) {
  Matrix3d map;
  map << 0.2, -0.1, 0.0, 0.1, 0.2, 0.0, 0.0, 0.0, 0.0;
  return Vector3d(0.002, -0.003, 0.01) + map * path_m;
}

double largest_error_m(TipOffset& offset, double rate, double from_s, double to_s) {
  double largest = 0.0;
  for (double t = kFrame_s; t < to_s; t += kFrame_s) {
    const TipReference path = circle(t, rate);
    offset.measure(t, offset_of(path.position_m), path.position_m);
    const TipReference soon = circle(t + 0.02, rate);
    if (t > from_s)
      largest = std::max(
          largest, (offset.at(t + 0.02, soon).position_m - offset_of(soon.position_m)).norm());
  }
  return largest;
}

TEST(TipOffset, LearnsWhatDependsOnThePlace) {
  // 1 Hz is far beyond the bandwidth of the line, 3 rad/s, which alone is 10 mm wrong here.
  const double rate = 2.0 * std::numbers::pi;
  TipOffset learns(3.0, 1.0, kReach_m), does_not(3.0, 0.0, kReach_m);
  EXPECT_LT(largest_error_m(learns, rate, 5.0, 10.0), 2e-4);
  EXPECT_GT(largest_error_m(does_not, rate, 5.0, 10.0), 5e-3);
}

TEST(TipOffset, DerivativesBelongToThePosition) {
  const double rate = 3.0, h = 1e-4;
  TipOffset offset(3.0, 1.0, kReach_m);
  largest_error_m(offset, rate, 5.0, 5.0);
  const double t = 5.01;
  const auto at = [&](double time_s) { return offset.at(time_s, circle(time_s, rate)); };
  EXPECT_LT((at(t).velocity_mps - (at(t + h).position_m - at(t - h).position_m) / (2.0 * h)).norm(),
            1e-6);
  EXPECT_LT(
      (at(t).acceleration_mps2 - (at(t + h).velocity_mps - at(t - h).velocity_mps) / (2.0 * h))
          .norm(),
      1e-6);
}

TEST(TipOffset, AnHourInOnePlaceMakesNothingOfNoise) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.3e-3);
  TipOffset offset(3.0, 1.0, kReach_m);
  const Vector3d place(0.05, 0.0, -0.28), d(0.003, 0.0, 0.004);
  double t = 0.0;
  for (int k = 0; k < 3600 * 200; ++k) {
    t += kFrame_s;
    offset.measure(t, d + Vector3d(noise(random), noise(random), noise(random)), place);
  }
  // Elsewhere it expects what it knows from here.
  const Vector3d there(-0.05, 0.05, -0.26);
  EXPECT_LT((offset.at(t, {there, Vector3d::Zero(), Vector3d::Zero()}).position_m - d).norm(),
            3e-3);
}

TEST(TipOffset, RestsWithoutMeasurementsAndForgetsAtAStart) {
  TipOffset offset(3.0, 1.0, kReach_m);
  const TipReference place{Vector3d(0.0, 0.0, -0.3), Vector3d::Zero(), Vector3d::Zero()};
  for (double t = kFrame_s; t < 2.0; t += kFrame_s)
    offset.measure(t, Vector3d(0.01 * t, 0.0, 0.0), place.position_m);
  EXPECT_NEAR(offset.at(2.0, place).velocity_mps.x(), 0.01, 1e-3);
  EXPECT_EQ(offset.at(3.0, place).velocity_mps, Vector3d::Zero());
  EXPECT_EQ(offset.at(3.0, place).position_m, offset.at(30.0, place).position_m);
  offset.measure(1.0, Vector3d::Constant(1.0), place.position_m);  // older: ignored
  EXPECT_LT(offset.at(2.0, place).position_m.norm(), 0.03);
  offset.start(40.0, Vector3d(0.0, 0.0, 0.005));
  EXPECT_EQ(offset.at(40.0, place).position_m, Vector3d(0.0, 0.0, 0.005));
}

TEST(TipOffset, AllocatesNothing) {
  TipOffset offset(3.0, 1.0, kReach_m);
  const long before = test::allocations;
  largest_error_m(offset, 2.0, 0.0, 1.0);
  EXPECT_EQ(test::allocations, before);
}

}  // namespace
}  // namespace softarm
