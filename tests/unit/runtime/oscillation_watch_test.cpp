// An error that oscillates and does not fade is found, nothing else is.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "counted_malloc.hpp"
#include "softarm/runtime/following.hpp"

namespace softarm {
namespace {

constexpr double kTick_s = 0.002;
using Signal = std::function<double(double time_s)>;

Signal sine(double amplitude, double hz) {
  return [=](double t) { return amplitude * std::sin(2.0 * std::numbers::pi * hz * t); };
}
Signal fading(double amplitude, double hz, double rate_1ps) {
  return [=](double t) { return std::exp(-rate_1ps * t) * sine(amplitude, hz)(t); };
}

/// When the second of four coordinates is found to oscillate; -1: not within `duration_s`.
double found_after_s(const Signal& error, const Signal& reference, double duration_s = 60.0,
                     const SafetySettings& settings = {}) {
  OscillationWatch watch(settings, kTick_s, 4);
  SegmentVector r = SegmentVector::Constant(4, 0.3), u = r;
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.004);
  for (double t = 0.0; t < duration_s; t += kTick_s) {
    r[1] = reference(t);
    u[1] = r[1] - error(t) + noise(random);
    watch.judge(r, u);
    if (watch.oscillates()) return t;
  }
  return -1.0;
}

const Signal kNothing = [](double) { return 0.0; };

TEST(OscillationWatch, FindsALimitCycleWithinItsPeriods) {
  for (const double hz : {0.8, 1.85, 5.0, 20.0}) {
    const double after_s = found_after_s(sine(0.1, hz), kNothing);
    EXPECT_GT(after_s, 3.5 / hz) << hz;
    EXPECT_LT(after_s, 6.5 / hz) << hz;
  }
}

TEST(OscillationWatch, FindsOneThatGrowsAndOneOnTopOfAnOffset) {
  EXPECT_GT(found_after_s(fading(1e-3, 1.85, -0.5), kNothing), 7.0);
  EXPECT_GT(found_after_s([](double t) { return 0.2 + sine(0.1, 1.85)(t); }, kNothing), 0.0);
}

TEST(OscillationWatch, FindsOneBesideAPeriodicReference) {
  EXPECT_GT(found_after_s(sine(0.15, 1.85), sine(0.4, 0.32)), 0.0);
}

TEST(OscillationWatch, WhatFadesIsNone) {
  for (const double rate_1ps : {0.6, 1.0, 3.0})
    EXPECT_LT(found_after_s(fading(0.5, 1.85, rate_1ps), kNothing), 0.0) << rate_1ps;
}

TEST(OscillationWatch, AnErrorThatFollowsThePeriodicReferenceIsNone) {
  for (const double hz : {0.1, 0.32, 1.3, 3.0})
    EXPECT_LT(found_after_s(sine(0.12, hz), sine(0.4, hz)), 0.0) << hz;
}

TEST(OscillationWatch, SmallSlowAndDisabledAreNone) {
  EXPECT_LT(found_after_s(sine(0.04, 1.85), kNothing), 0.0);
  EXPECT_LT(found_after_s(sine(0.3, 0.3), kNothing), 0.0);
  SafetySettings off;
  off.oscillation_rad = 0.0;
  EXPECT_LT(found_after_s(sine(1.0, 1.85), kNothing, 60.0, off), 0.0);
}

TEST(OscillationWatch, StartsAgain) {
  OscillationWatch watch({}, kTick_s, 2);
  SegmentVector r = SegmentVector::Zero(2), u = r;
  const Signal swing = sine(0.1, 2.0);
  const long before = test::allocations;
  for (double t = 0.0; t < 60.0; t += kTick_s) {
    u[0] = swing(t);
    watch.judge(r, u);
    if (std::fmod(t, 1.0) < kTick_s) watch.reset();
    ASSERT_FALSE(watch.oscillates());
  }
  EXPECT_EQ(test::allocations, before);
}

}  // namespace
}  // namespace softarm
