#include "softarm/actuation/command_expiry.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <stdexcept>

namespace softarm {
namespace {

constexpr std::int64_t kMs = 1'000'000;

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

TEST_F(Expiry, ASenderMayStartAgainOnceTheArmIsVented) {
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

TEST(LongestValidity, CutsWhatASenderAsksFor) {
  CommandExpiry expiry(1, 100 * kMs);
  const std::array<double, 1> pressure{0.3};
  // 2^31 us: nanoseconds taken for microseconds.
  EXPECT_EQ(expiry.receive({.sequence = std::int64_t{1} << 62,
                            .validity_ns = (std::int64_t{1} << 31) * 1000,
                            .pressure_bar = pressure},
                           5 * kMs),
            CommandVerdict::in_force);
  EXPECT_EQ(expiry.expires_ns(), 105 * kMs);
  EXPECT_TRUE(expiry.update(105 * kMs));
  EXPECT_EQ(
      expiry.receive({.sequence = 1, .validity_ns = 50 * kMs, .pressure_bar = pressure}, 106 * kMs),
      CommandVerdict::in_force)
      << "others are heard again";
}

TEST_F(Expiry, NegativeCountsAreRefused) { EXPECT_THROW(CommandExpiry(-1), std::invalid_argument); }

}  // namespace
}  // namespace softarm
