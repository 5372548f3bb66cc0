#include "softarm/plant/valves.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace softarm {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(Valves, FollowAStepAsAFirstOrderLagDoes) {
  Valves valves({.lag_s = 0.02, .supply_pressure_bar = 2.0}, 2);
  valves.command(std::array{1.5, 0.4});
  for (int k = 1; k <= 200; ++k) {
    valves.advance(0.5e-3);
    const double t = 0.5e-3 * k;
    EXPECT_NEAR(valves.pressures_bar()[0], 1.5 * (1.0 - std::exp(-t / 0.02)), 1e-13);
    EXPECT_NEAR(valves.pressures_bar()[1], 0.4 * (1.0 - std::exp(-t / 0.02)), 1e-13);
  }
}

TEST(Valves, StepsOfAnySizeLeadToTheSamePressure) {
  Valves once({.lag_s = 0.03, .supply_pressure_bar = 2.0}, 1);
  Valves often = once;
  once.command(std::array{1.0});
  often.command(std::array{1.0});
  once.advance(0.05);
  for (int k = 0; k < 50000; ++k) often.advance(1e-6);
  EXPECT_NEAR(once.pressures_bar()[0], often.pressures_bar()[0], 1e-12);
  // What an integrator looks ahead to is where the valve then is.
  const double ahead = once.commanded_bar()[0] +
                       once.remaining(0.01) * (once.pressures_bar()[0] - once.commanded_bar()[0]);
  once.advance(0.01);
  EXPECT_NEAR(once.pressures_bar()[0], ahead, 1e-15);
}

TEST(Valves, WithoutLagTheCommandIsThePressure) {
  Valves valves({.lag_s = 0.0, .supply_pressure_bar = 2.0}, 1);
  valves.command(std::array{0.7});
  EXPECT_EQ(valves.pressures_bar()[0], 0.7);
  EXPECT_EQ(valves.remaining(1e-9), 0.0);
}

TEST(Valves, NeverLeaveTheSupply) {
  Valves valves({.lag_s = 0.01, .supply_pressure_bar = 2.0}, 3);
  valves.command(std::array{7.0, -3.0, std::numeric_limits<double>::quiet_NaN()});
  for (int k = 0; k < 100; ++k) {
    valves.advance(0.01);
    EXPECT_LE(valves.pressures_bar().maxCoeff(), 2.0);
    EXPECT_GE(valves.pressures_bar().minCoeff(), 0.0);
  }
  EXPECT_NEAR(valves.pressures_bar()[0], 2.0, 1e-12);
  EXPECT_EQ(valves.pressures_bar()[1], 0.0);
  EXPECT_EQ(valves.pressures_bar()[2], 0.0);
}

TEST(Valves, RefuseSettingsThatMeanNothing) {
  EXPECT_THROW(Valves({.lag_s = -0.1}, 1), std::invalid_argument);
  EXPECT_THROW(Valves({.lag_s = std::nan("")}, 1), std::invalid_argument);
  EXPECT_THROW(Valves({.lag_s = 0.0, .supply_pressure_bar = -1.0}, 1), std::invalid_argument);
  EXPECT_THROW(Valves(ValveSettings{}, -1), std::invalid_argument);
  EXPECT_THROW(CommandExpiry(-1), std::invalid_argument);
}

class Expiry : public ::testing::Test {
 protected:
  PressureCommand command(std::int64_t sequence, std::int64_t validity_ns = 100 * kMs) {
    return {.sequence = sequence, .validity_ns = validity_ns, .pressure_bar = pressures};
  }
  std::array<double, 2> pressures{0.5, 1.0};
  CommandExpiry expiry{2};
};

TEST_F(Expiry, IsVentedUntilTheFirstCommand) {
  EXPECT_TRUE(expiry.vented());
  EXPECT_EQ(expiry.sequence(), CommandExpiry::kNoSequence);
  EXPECT_FALSE(expiry.update(1'000'000 * kMs));
  EXPECT_TRUE(expiry.set_points_bar().isZero());
}

TEST_F(Expiry, VentsAtTheEndOfTheValidityAndNotBefore) {
  EXPECT_EQ(expiry.receive(command(0), 10 * kMs), CommandVerdict::in_force);
  EXPECT_EQ(expiry.set_points_bar()[1], 1.0);
  EXPECT_EQ(expiry.expires_ns(), 110 * kMs);
  EXPECT_FALSE(expiry.update(110 * kMs - 1));
  EXPECT_FALSE(expiry.vented());
  EXPECT_TRUE(expiry.update(110 * kMs));
  EXPECT_TRUE(expiry.vented());
  EXPECT_TRUE(expiry.set_points_bar().isZero());
  EXPECT_FALSE(expiry.update(111 * kMs));  // only once
}

TEST_F(Expiry, NewerCommandsKeepItAlive) {
  for (int k = 0; k < 100; ++k) {
    ASSERT_EQ(expiry.receive(command(k), 50 * kMs * k), CommandVerdict::in_force);
  }
  EXPECT_EQ(expiry.expires_ns(), 50 * kMs * 99 + 100 * kMs);
}

TEST_F(Expiry, OlderAndRepeatedSequencesNeitherActNorProlong) {
  expiry.receive(command(7), 0);
  pressures = {2.0, 2.0};
  EXPECT_EQ(expiry.receive(command(7), 90 * kMs), CommandVerdict::older);
  EXPECT_EQ(expiry.receive(command(3), 95 * kMs), CommandVerdict::older);
  EXPECT_EQ(expiry.set_points_bar()[0], 0.5);
  EXPECT_TRUE(expiry.update(100 * kMs));
}

TEST_F(Expiry, ASenderMayStartAnewOnceTheArmIsVented) {
  expiry.receive(command(1'000'000), 0);
  EXPECT_EQ(expiry.receive(command(0), 50 * kMs), CommandVerdict::older);
  EXPECT_EQ(expiry.receive(command(0), 100 * kMs), CommandVerdict::in_force);
}

TEST_F(Expiry, ShadowCommandsNeverReachTheValves) {
  PressureCommand shadow = command(5);
  shadow.shadow = true;
  EXPECT_EQ(expiry.receive(shadow, 0), CommandVerdict::shadow);
  EXPECT_TRUE(expiry.vented());
  expiry.receive(command(1), 0);
  pressures = {2.0, 2.0};
  shadow.sequence = 9;
  EXPECT_EQ(expiry.receive(shadow, 10 * kMs), CommandVerdict::shadow);
  EXPECT_EQ(expiry.sequence(), 1);
  EXPECT_EQ(expiry.set_points_bar()[0], 0.5);
  EXPECT_EQ(expiry.expires_ns(), 100 * kMs);
}

TEST_F(Expiry, MalformedCommandsAreRefused) {
  EXPECT_EQ(expiry.receive(command(1, 0), 0), CommandVerdict::malformed);
  EXPECT_EQ(expiry.receive(command(1, -5), 0), CommandVerdict::malformed);
  EXPECT_EQ(expiry.receive(command(-1), 0), CommandVerdict::malformed);
  PressureCommand one_pressure = command(1);
  one_pressure.pressure_bar = one_pressure.pressure_bar.first(1);
  EXPECT_EQ(expiry.receive(one_pressure, 0), CommandVerdict::malformed);
  pressures[1] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(expiry.receive(command(1), 0), CommandVerdict::malformed);
  EXPECT_TRUE(expiry.vented());
}

TEST_F(Expiry, AVeryLongValidityDoesNotWrapAround) {
  EXPECT_EQ(expiry.receive(command(1, INT64_MAX), 5), CommandVerdict::in_force);
  EXPECT_FALSE(expiry.vented());
  EXPECT_FALSE(expiry.update(INT64_MAX / 2));
  EXPECT_FALSE(expiry.vented());
}

}  // namespace
}  // namespace softarm
