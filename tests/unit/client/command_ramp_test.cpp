// What may leave for the valves: never beyond a limit, never faster than the slew, from zero again
// after a command has expired. Time is an argument here.
#include "client/command_ramp.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "milliseconds.hpp"
#include "softarm/base/time.hpp"

namespace softarm {
namespace {

using test::kMs;
constexpr double kValidity_s = 0.1;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

ActuationSettings two_chambers() {
  ActuationSettings actuation;
  actuation.segments = {{{0.0, 0.839}, {M_PI, 0.839}}};
  actuation.min_pressure_bar = 0.0;
  actuation.max_pressure_bar = 1.5;
  actuation.slew_bar_per_s = 4.0;
  actuation.vent_bar_per_s = 8.0;
  return actuation;
}

PressureVector both(double bar) { return PressureVector::Constant(2, bar); }

TEST(CommandRamp, RisesAtTheSlewToTheLimitAndFallsAtTheVentRate) {
  CommandRamp ramp(two_chambers(), kValidity_s);
  std::int64_t now_ns = 1'000'000 * kMs;
  EXPECT_TRUE(ramp.due(now_ns));
  const auto send = [&](auto&& step) {
    step();
    const auto command = ramp.next(now_ns);
    now_ns = ramp.next_ns();
    return command;
  };
  const auto rise = [&] { ramp.approach(both(9.0), kInf, now_ns); };
  EXPECT_EQ(send(rise).pressure_bar, (std::vector<float>{0.0F, 0.0F})) << "the first is zero";
  EXPECT_EQ(ramp.next_ns() - ramp.sent_ns(), 10 * kMs);
  EXPECT_FALSE(ramp.due(now_ns - 1));
  EXPECT_FLOAT_EQ(send(rise).pressure_bar[0], 0.04F);
  EXPECT_FLOAT_EQ(send(rise).pressure_bar[1], 0.08F);
  for (int k = 0; k < 40; ++k) send(rise);
  EXPECT_EQ(send(rise).pressure_bar, (std::vector<float>{1.5F, 1.5F})) << "actuation.max_pressure";
  EXPECT_FLOAT_EQ(send([&] { ramp.vent(now_ns); }).pressure_bar[0], 1.42F);
  EXPECT_EQ(ramp.next(now_ns).validity_us, 100'000);
  EXPECT_FALSE(ramp.held_up());
}

TEST(CommandRamp, ASlowerRateIsKeptAndAFasterOneIsNot) {
  CommandRamp ramp(two_chambers(), kValidity_s);
  std::int64_t now_ns = kMs;
  for (int k = 0; k < 2; ++k) {
    ramp.approach(both(1.0), 0.5, now_ns);
    ramp.next(now_ns);
    now_ns = ramp.next_ns();
  }
  EXPECT_NEAR(ramp.set_points_bar()[0], 0.005, 1e-12);
  ramp.approach(both(1.0), 1e6, now_ns);
  EXPECT_NEAR(ramp.set_points_bar()[0], 0.045, 1e-12);
}

TEST(CommandRamp, AfterAnExpiryItBeginsAtZeroAndSaysSo) {
  CommandRamp ramp(two_chambers(), kValidity_s);
  std::int64_t now_ns = kMs;
  for (int k = 0; k < 20; ++k, now_ns = ramp.next_ns()) {
    ramp.approach(both(1.0), kInf, now_ns);
    ramp.next(now_ns);
  }
  const std::int64_t sent_ns = ramp.sent_ns();
  // Still valid: it goes on from where it was, by a step that does not make up for the pause.
  now_ns = sent_ns + 99 * kMs;
  ramp.approach(both(1.0), kInf, now_ns);
  const double before_bar = static_cast<double>(ramp.next(now_ns).pressure_bar[0]);
  EXPECT_NEAR(before_bar, 0.04 * 20, 1e-6);
  EXPECT_FALSE(ramp.held_up());
  now_ns += 100 * kMs;
  ramp.approach(both(1.0), kInf, now_ns);
  EXPECT_EQ(ramp.next(now_ns).pressure_bar, (std::vector<float>{0.0F, 0.0F}));
  EXPECT_TRUE(ramp.held_up());
}

/// A program that begins while the last command of another one expires has not been held up.
TEST(CommandRamp, ValvesThatVentBeforeTheFirstCommandDoNotCount) {
  CommandRamp ramp(two_chambers(), kValidity_s);
  ramp.interrupt();
  EXPECT_FALSE(ramp.held_up());
  ramp.next(kMs);
  ramp.interrupt();
  EXPECT_TRUE(ramp.held_up());
}

TEST(CommandRamp, AShortValidityIsRefreshedFourTimes) {
  CommandRamp ramp(two_chambers(), 0.008);
  ramp.next(kMs);
  EXPECT_EQ(ramp.next_ns(), 3 * kMs);
}

TEST(CommandRamp, WhateverIsWantedAndWheneverTheLimitsHold) {
  const ActuationSettings actuation = two_chambers();
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    const auto chance = [&](double part) {
      return std::uniform_real_distribution(0.0, 1.0)(random) < part;
    };
    const auto any_pressure = [&] {
      constexpr double kOdd[] = {kNan, kInf, -kInf, -1.0, 1e300};
      return chance(0.2) ? kOdd[random() % 5] : std::uniform_real_distribution(0.0, 2.0)(random);
    };
    CommandRamp ramp(actuation, kValidity_s);
    std::int64_t now_ns = 1'000 * kMs;
    std::vector<float> before = {0.0F, 0.0F};
    std::int64_t before_ns = -1'000'000 * kMs, sequence = 0;
    int expiries = 0;
    for (int k = 0; k < 5000; ++k) {
      now_ns += chance(0.005) ? 150 * kMs : static_cast<std::int64_t>(random() % 9) * kMs;
      if (chance(0.2)) {
        ramp.vent(now_ns);
      } else {
        const PressureVector wanted =
            (PressureVector(2) << any_pressure(), any_pressure()).finished();
        ramp.approach(wanted, chance(0.3) ? any_pressure() : kInf, now_ns);
      }
      if (!ramp.due(now_ns)) continue;
      const auto command = ramp.next(now_ns);
      ASSERT_EQ(command.sequence, ++sequence);
      ASSERT_EQ(command.shadow, 0);
      const bool expired = now_ns - before_ns >= 100 * kMs;
      expiries += expired ? 1 : 0;
      const double passed_s = to_seconds(now_ns - before_ns);
      for (std::size_t j = 0; j < 2; ++j) {
        const float bar = command.pressure_bar[j];
        ASSERT_GE(bar, 0.0F);
        ASSERT_LE(bar, 1.5F);
        if (expired) {
          ASSERT_EQ(bar, 0.0F);
        } else {
          ASSERT_LE(static_cast<double>(bar - before[j]), 4.0 * passed_s + 1e-6);
          ASSERT_GE(static_cast<double>(bar - before[j]), -8.0 * passed_s - 1e-6);
        }
      }
      before = command.pressure_bar;
      before_ns = now_ns;
    }
    EXPECT_GT(expiries, 5);
    EXPECT_TRUE(ramp.held_up());
  }
}

TEST(CommandRamp, KnowsItsOwnCommandsFromOthers) {
  CommandRamp ramp(two_chambers(), kValidity_s);
  std::vector<ChamberCommand> sent;
  for (int k = 0; k < 100; ++k) {
    const auto& message = ramp.next((k + 1) * 10 * kMs);
    sent.push_back({.sequence = message.sequence, .time_us = message.time_us, .pressure_bar = {}});
  }
  for (const ChamberCommand& each : sent) EXPECT_TRUE(ramp.is_ours(each)) << each.sequence;
  ChamberCommand other = sent[50];
  ++other.time_us;
  EXPECT_FALSE(ramp.is_ours(other)) << "the same number from another clock";
  other = sent.back();
  ++other.sequence;
  EXPECT_FALSE(ramp.is_ours(other)) << "a number that was not used yet";
  EXPECT_FALSE(ramp.is_ours({.sequence = 0, .pressure_bar = {}}));
  EXPECT_FALSE(ramp.is_ours({.sequence = -3, .pressure_bar = {}}));
}

}  // namespace
}  // namespace softarm
