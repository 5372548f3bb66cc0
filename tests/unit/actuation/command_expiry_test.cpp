#include "softarm/actuation/command_expiry.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <stdexcept>

#include "milliseconds.hpp"

namespace softarm {
namespace {

using test::kMs;

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
  EXPECT_EQ(expiry.receive(command(0), 50 * kMs), CommandVerdict::other_sender);
  EXPECT_EQ(expiry.receive(command(0), 100 * kMs), CommandVerdict::in_force);
}

// Two senders with one clock or with two: numbers and times do not go on together.
TEST_F(Expiry, OnlyOneSenderIsObeyedAtATime) {
  const auto at = [&](std::int64_t sequence, std::int64_t sent_us) {
    PressureCommand it = command(sequence);
    it.sent_us = sent_us;
    return it;
  };
  const auto receive = [&](const PressureCommand& second, std::int64_t second_ns) {
    CommandExpiry fresh(2);
    EXPECT_EQ(fresh.receive(at(1000, 7'000'000), 7'000 * kMs), CommandVerdict::in_force);
    const CommandVerdict verdict = fresh.receive(second, second_ns);
    EXPECT_EQ(fresh.sequence(), verdict == CommandVerdict::in_force ? second.sequence : 1000);
    return verdict;
  };
  const std::int64_t now_ns = 7'002 * kMs;
  using enum CommandVerdict;
  EXPECT_EQ(receive(at(1001, 7'002'000), now_ns), in_force);
  EXPECT_EQ(receive(at(1050, 7'050'000), 7'090 * kMs), in_force) << "some were lost";
  EXPECT_EQ(receive(at(1000, 7'000'000), now_ns), older) << "sent twice by the network";
  EXPECT_EQ(receive(at(998, 6'996'000), now_ns), older) << "overtaken";
  EXPECT_EQ(receive(at(1000, 7'001'000), now_ns), other_sender) << "the same number again";
  EXPECT_EQ(receive(at(990, 7'001'000), now_ns), other_sender) << "an old number, a new time";
  EXPECT_EQ(receive(at(1, 7'001'000), now_ns), other_sender) << "it has started again";
  EXPECT_EQ(receive(at(900, 6'800'000), now_ns), other_sender) << "no packet is so late";
  EXPECT_EQ(receive(at(1001, 6'999'000), now_ns), other_sender) << "a new number, an old time";
  EXPECT_EQ(receive(at(1001, 9'000'000'000), now_ns), other_sender) << "another machine's clock";
  EXPECT_EQ(receive(at(999, 1), now_ns), other_sender) << "another machine's clock";
  EXPECT_EQ(receive(at(1001, 0), now_ns), other_sender) << "it gives no time";
  EXPECT_EQ(receive(at(1001, INT64_MAX), now_ns), other_sender);
  EXPECT_EQ(receive(at(1001, INT64_MIN), now_ns), other_sender);
  // A higher number is taken if nothing else betrays it; then the first sender is the other one.
  ASSERT_EQ(expiry.receive(at(1000, 7'000'000), 7'000 * kMs), in_force);
  ASSERT_EQ(expiry.receive(at(5000, 7'001'000), 7'001 * kMs), in_force);
  EXPECT_EQ(expiry.receive(at(1001, 7'002'000), 7'002 * kMs), other_sender);
  EXPECT_EQ(expiry.receive(at(1002, 7'150'000), 7'150 * kMs), in_force) << "it has expired";
}

TEST_F(Expiry, WhereSendersGiveNoTimeNumbersAloneDecide) {
  ASSERT_EQ(expiry.receive(command(1000), 0), CommandVerdict::in_force);
  EXPECT_EQ(expiry.receive(command(1000), 1), CommandVerdict::older);
  EXPECT_EQ(expiry.receive(command(984), 2), CommandVerdict::older);
  EXPECT_EQ(expiry.receive(command(983), 3), CommandVerdict::other_sender);
  EXPECT_EQ(expiry.receive(command(INT64_MAX), 4), CommandVerdict::in_force);
  EXPECT_EQ(expiry.receive(command(1001), 5), CommandVerdict::other_sender);
}

TEST(Untimely, IsWhatWasNotSentNow) {
  constexpr std::int64_t kNow = 50'000'000, kValidity = 100'000;
  EXPECT_FALSE(is_untimely(kNow, kValidity, kNow));
  EXPECT_FALSE(is_untimely(kNow - kValidity + 1, kValidity, kNow));
  EXPECT_TRUE(is_untimely(kNow - kValidity, kValidity, kNow));
  EXPECT_FALSE(is_untimely(kNow + kValidity, kValidity, kNow));
  EXPECT_TRUE(is_untimely(kNow + kValidity + 1, kValidity, kNow)) << "of an earlier boot";
  EXPECT_TRUE(is_untimely(-5, kValidity, kNow));
  EXPECT_TRUE(is_untimely(INT64_MIN, kValidity, kNow));
  EXPECT_TRUE(is_untimely(INT64_MAX, kValidity, kNow));
  EXPECT_FALSE(is_untimely(0, kValidity, kNow)) << "unknown";
  EXPECT_FALSE(is_untimely(1'700'000'000'000'000, kValidity, kNow)) << "the wall clock";
  EXPECT_FALSE(is_untimely(1'000'000'000'000'001, kValidity, kNow)) << "the wall clock";
  EXPECT_TRUE(is_untimely(1'000'000'000'000'000, kValidity, kNow)) << "not yet";
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

TEST_F(Expiry, NegativeCountsAreRefused) {
  EXPECT_THROW(CommandExpiry(-1), std::invalid_argument);
  EXPECT_NO_THROW(CommandExpiry(0));
}

TEST_F(Expiry, TheSendersClockMayBeCoarseAndThePacketLate) {
  constexpr std::int64_t kDelay_us = 500'000, kNow_us = 1'000'000'000;
  const auto verdict = [this](std::int64_t sequence, std::int64_t sent_us) {
    CommandExpiry fresh(2);
    PressureCommand first = command(5), other = command(sequence);
    first.sent_us = kNow_us;
    other.sent_us = sent_us;
    EXPECT_EQ(fresh.receive(first, 0), CommandVerdict::in_force);
    return fresh.receive(other, 1 * kMs);
  };
  EXPECT_EQ(verdict(6, kNow_us), CommandVerdict::in_force) << "its clock stands";
  EXPECT_EQ(verdict(6, kNow_us - 1), CommandVerdict::other_sender);
  EXPECT_EQ(verdict(6, kNow_us + 1'000 + kDelay_us), CommandVerdict::in_force);
  EXPECT_EQ(verdict(6, kNow_us + 1'001 + kDelay_us), CommandVerdict::other_sender);
  EXPECT_EQ(verdict(4, kNow_us), CommandVerdict::older);
  EXPECT_EQ(verdict(4, kNow_us + 1), CommandVerdict::other_sender);
  EXPECT_EQ(verdict(4, kNow_us - kDelay_us), CommandVerdict::older);
  EXPECT_EQ(verdict(4, kNow_us - kDelay_us - 1), CommandVerdict::other_sender);
}

}  // namespace
}  // namespace softarm
