#include "softarm/simulation/valve_side.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "milliseconds.hpp"

namespace softarm {
namespace {

using test::kMs;

class SideOfThePlant : public ::testing::Test {
 protected:
  static ActuationSettings settings() {
    ActuationSettings settings;
    settings.segments.assign(1, std::vector<Chamber>(2));
    settings.slew_bar_per_s = 10.0;
    return settings;
  }
  CommandVerdict command(std::int64_t number, double pressure_bar) {
    const std::array<double, 2> pressures{pressure_bar, pressure_bar};
    return side.receive({.sequence = number, .validity_ns = 100 * kMs, .pressure_bar = pressures},
                        now);
  }
  double bar() const { return side.set_points().maxCoeff(); }
  /// A command every 2 ms.
  void run(std::int64_t duration_ns, double wanted) {
    for (const std::int64_t end = now + duration_ns; now < end;) {
      const double before = bar();
      now += 2 * kMs;
      command(++sequence, wanted);
      ASSERT_LE(bar() - before, 0.02 + 1e-12);
    }
  }

  ValveSide side{settings(), 100 * kMs};
  std::int64_t now = 5'000 * kMs, sequence = 0;
};

TEST_F(SideOfThePlant, NoRiseIsFasterThanTheSlew) {
  run(20 * kMs, 2.0);
  EXPECT_NEAR(bar(), 0.18, 1e-12);
  // A command that is the last one is reached by itself, until it expires.
  while (side.next_event_ns() < now + 50 * kMs) side.update(side.next_event_ns());
  EXPECT_NEAR(bar(), 0.68, 0.011);
  run(1000 * kMs, 1.0);
  EXPECT_EQ(bar(), 1.0);
  run(2 * kMs, 0.3);
  EXPECT_EQ(bar(), 0.3) << "down at once";
}

TEST_F(SideOfThePlant, ExpiryVentsAndTheRiseBeginsAtZero) {
  run(200 * kMs, 0.8);
  ASSERT_EQ(side.next_event_ns(), now + 100 * kMs);
  side.update(now + 100 * kMs);
  EXPECT_TRUE(side.vented());
  EXPECT_EQ(side.times_vented(), 1);
  EXPECT_EQ(bar(), 0.0);
  EXPECT_EQ(side.sequence(), CommandExpiry::kNoSequence);
  now += 500 * kMs;
  run(20 * kMs, 0.8);
  EXPECT_NEAR(bar(), 0.18, 1e-12);
}

TEST_F(SideOfThePlant, ASecondSenderVentsUntilItHasLeftAndZeroWasCommanded) {
  run(200 * kMs, 0.8);
  const double before = bar();
  command(1'000'000, 2.0);
  EXPECT_EQ(bar(), before) << "no time has passed";
  now += 2 * kMs;
  EXPECT_EQ(command(++sequence, 0.8), CommandVerdict::other_sender);
  EXPECT_TRUE(side.degraded(now));
  EXPECT_EQ(bar(), 0.0);
  const std::int64_t seen_ns = now;
  for (const std::int64_t end = now + 600 * kMs; now < end;) {
    now += 2 * kMs;
    command(++sequence, 0.8);
    ASSERT_EQ(bar(), 0.0) << (now - seen_ns) / kMs << " ms later";
  }
  EXPECT_TRUE(side.degraded(now));
  run(2 * kMs, 0.0);
  EXPECT_FALSE(side.degraded(now));
  run(200 * kMs, 0.8);
  EXPECT_EQ(bar(), 0.8);
}

TEST_F(SideOfThePlant, APauseEndsWhatWasInForce) {
  run(200 * kMs, 0.8);
  side.pause();
  EXPECT_TRUE(side.vented());
  EXPECT_EQ(bar(), 0.0);
  EXPECT_EQ(side.times_vented(), 1);
}

}  // namespace
}  // namespace softarm
