#include "softarm/actuation/pressure_ramps.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace softarm {
namespace {

TEST(RiseTowards, LimitsTheWayFromZeroAndNotTheWayToIt) {
  EXPECT_EQ(rise_towards(0.5, 2.0, 0.1), 0.6);
  EXPECT_EQ(rise_towards(0.5, 0.55, 0.1), 0.55);
  EXPECT_EQ(rise_towards(0.5, 0.0, 0.1), 0.0);
  EXPECT_EQ(rise_towards(-0.5, -2.0, 0.25), -0.75);
  EXPECT_EQ(rise_towards(0.5, -2.0, 0.25), -0.25) << "through zero";
  EXPECT_EQ(rise_towards(0.5, 2.0, -1.0), 0.5);
  EXPECT_EQ(rise_towards(0.5, std::nan(""), 1.0), 0.0);
}

ActuationSettings limits() {
  ActuationSettings settings;
  settings.min_pressure_bar = 0.1;
  settings.max_pressure_bar = 2.0;
  settings.slew_bar_per_s = 40.0;
  settings.vent_bar_per_s = 8.0;
  return settings;
}

PressureVector one(double value) { return PressureVector::Constant(1, value); }

TEST(PressureRamps, InsideTheLimitsNothingHappens) {
  const PressureRamps ramps(limits());
  std::mt19937 engine(1);
  std::uniform_real_distribution<> pressure(0.1, 2.0), share(-1.0, 1.0);
  PressureVector out;
  for (int trial = 0; trial < 1000; ++trial) {
    const double previous = pressure(engine), dt = 0.002;
    const double wanted = std::clamp(previous + 0.999 * share(engine) * 40.0 * dt, 0.1, 2.0);
    ramps.limit(one(previous), one(wanted), dt, out);
    EXPECT_EQ(out[0], wanted);
  }
}

TEST(PressureRamps, OutsideItMovesByTheLimitAndArrives) {
  const PressureRamps ramps(limits());
  std::mt19937 engine(2);
  std::uniform_real_distribution<> pressure(-3.0, 5.0), start(0.0, 2.0);
  PressureVector out;
  for (int trial = 0; trial < 1000; ++trial) {
    PressureVector now = one(start(engine));
    const PressureVector wanted = one(pressure(engine));
    const double end = std::clamp(wanted[0], 0.1, 2.0), way = std::abs(end - now[0]);
    const int steps = static_cast<int>(std::ceil(way / (40.0 * 0.002) - 1e-9));
    for (int i = 0; i < steps; ++i) {
      const double before = now[0];
      ramps.limit(now, wanted, 0.002, now);  // in place
      EXPECT_LE(std::abs(now[0] - before), 0.08 + 1e-15);
      EXPECT_LE(std::abs(end - now[0]), std::abs(end - before));
    }
    EXPECT_NEAR(now[0], end, 1e-12);
  }
}

TEST(PressureRamps, WhatIsNotANumberLeavesThePressure) {
  const PressureRamps ramps(limits());
  PressureVector out;
  ramps.limit(one(0.7), one(NAN), 0.002, out);
  EXPECT_EQ(out[0], 0.7);
  ramps.limit(one(0.7), one(1.0), 0.0, out);
  EXPECT_EQ(out[0], 0.7);
  ramps.limit(one(0.7), one(1.0), -1.0, out);
  EXPECT_EQ(out[0], 0.7);
  ramps.limit(one(0.7), one(1.0), NAN, out);
  EXPECT_EQ(out[0], 0.7);
  ramps.limit(one(0.7), one(std::numeric_limits<double>::infinity()), 1.0, out);
  EXPECT_EQ(out[0], 2.0);
}

TEST(PressureRamps, VentEndsAtZeroInTheTimeItsRateSays) {
  const PressureRamps ramps(limits());
  PressureVector now(3);
  now << 2.0, 0.4, -0.2;
  for (int i = 0; i < 124; ++i) ramps.vent(now, 0.002, now);
  EXPECT_GT(now[0], 0.0);
  EXPECT_EQ(now[1], 0.0);
  EXPECT_EQ(now[2], 0.0);
  ramps.vent(now, 0.004, now);
  EXPECT_EQ(now[0], 0.0);  // 2 bar at 8 bar/s: 0.25 s
}

TEST(PressureRamps, RepeatedIsTheSameAsLonger) {
  for (double wanted : {-1.0, 0.3, 5.0}) {
    double twice = step_towards(step_towards(0.5, wanted, 0.05), wanted, 0.05);
    EXPECT_NEAR(twice, step_towards(0.5, wanted, 0.1), 1e-15);
  }
}

}  // namespace
}  // namespace softarm
