// Receive stamps of a wall clock that is set now and then, against the arrivals that they stand
// for.
#include "softarm/transport/arrival_clock.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

#include "milliseconds.hpp"
#include "softarm/estimation/clock_relation.hpp"

namespace softarm {
namespace {

using test::kMs;
constexpr std::int64_t kUs = 1000, kSecond = 1'000'000'000;
constexpr std::int64_t kDate_ns = 1'700'000'000 * kSecond;

/// Packets every 5 ms, handled by a loop of 2 ms that is held up for up to 80 ms now and then.
class StampedPackets : public ::testing::Test {
 protected:
  struct Packet {
    std::int64_t arrival_ns, stamp_us;
  };

  /// The loop goes on `held_up_ns` late; the wall clock is set by `step_ns` at a random moment
  /// meanwhile. What arrived, in order.
  std::vector<Packet> pass(std::int64_t held_up_ns = 0, std::int64_t step_ns = 0) {
    const std::int64_t until_ns = now_ns_ + 2 * kMs + held_up_ns;
    const std::int64_t set_ns = std::uniform_int_distribution(now_ns_, until_ns)(random_);
    std::vector<Packet> packets;
    for (; next_ns_ <= until_ns; next_ns_ += 5 * kMs) {
      const std::int64_t arrival_ns = std::min(
          until_ns, next_ns_ + std::uniform_int_distribution<std::int64_t>(0, kMs)(random_));
      const std::int64_t wall_ns =
          arrival_ns + wall_minus_ns_ + (arrival_ns >= set_ns ? step_ns : 0);
      packets.push_back({arrival_ns, wall_ns / kUs});
    }
    wall_minus_ns_ += step_ns;
    now_ns_ = until_ns;
    clock_.look({now_ns_, now_ns_ + wall_minus_ns_});
    return packets;
  }

  std::mt19937 random_{5};
  std::int64_t now_ns_ = 10 * kSecond, next_ns_ = now_ns_;
  std::int64_t wall_minus_ns_ = kDate_ns;
  ArrivalClock clock_{{now_ns_, now_ns_ + wall_minus_ns_}};
};

const std::vector<std::int64_t> kSteps{
    -3600 * kSecond, -kSecond, -40 * kMs, -3 * kMs,      -kMs, kMs,
    3 * kMs,         40 * kMs, kSecond,   3600 * kSecond};

TEST_F(StampedPackets, AreDatedToTheMicrosecondWhileTheWallClockRuns) {
  for (int k = 0; k < 2000; ++k)
    for (const Packet& packet : pass(k % 100 == 50 ? 80 * kMs : 0)) {
      const std::int64_t found_ns = clock_.arrival_ns(packet.stamp_us);
      EXPECT_LE(found_ns, packet.arrival_ns);
      EXPECT_GT(found_ns, packet.arrival_ns - kUs);
    }
}

TEST_F(StampedPackets, ASetWallClockMakesNoneOlderAndNoneYoungerThanItsLook) {
  for (int round = 0; round < 50; ++round)
    for (const std::int64_t step_ns : kSteps) {
      std::int64_t newest_ns = 0;
      for (int k = 0; k < 20; ++k)
        for (const Packet& packet :
             pass(k == 10 ? 80 * kMs * (round % 2) : 0, k == 10 ? step_ns : 0)) {
          const std::int64_t found_ns = clock_.arrival_ns(packet.stamp_us);
          ASSERT_GT(found_ns, packet.arrival_ns - kUs) << step_ns << " ns";
          ASSERT_LE(found_ns, k == 10 ? now_ns_ : packet.arrival_ns) << step_ns << " ns";
          ASSERT_GE(found_ns, newest_ns) << "decreases";
          newest_ns = found_ns;
        }
    }
}

// One arrival that looks too early would make every frame of the next two seconds look that much
// older: HOLD, without a fault of anybody.
TEST_F(StampedPackets, CaptureTimesAreNotDisturbedByASetWallClock) {
  for (const std::int64_t step_ns : kSteps) {
    ClockRelation relation(ClockMode::sender, 0.0);
    for (int k = 0; k < 500; ++k)
      for (const Packet& packet : pass(k == 250 ? 80 * kMs : 0, k == 250 ? step_ns : 0)) {
        const std::int64_t sent_us = (packet.arrival_ns - packet.arrival_ns % (5 * kMs)) / kUs;
        const std::int64_t capture_ns =
            relation.capture_ns(clock_.arrival_ns(packet.stamp_us), sent_us);
        ASSERT_GE(capture_ns, kUs * sent_us - kUs) << "older than it is after " << step_ns << " ns";
      }
  }
}

TEST_F(StampedPackets, ThatWaitedBeforeTheyWereHandedOverAreAsOldAsTheyAre) {
  const std::vector<Packet> packets = pass(60 * kMs);
  pass();
  pass();
  for (const Packet& packet : packets) {
    EXPECT_NEAR(static_cast<double>(clock_.arrival_ns(packet.stamp_us)),
                static_cast<double>(packet.arrival_ns), kUs);
  }
}

TEST_F(StampedPackets, WithImpossibleStampsHaveArrivedWhenTheyAreSeen) {
  for (const std::int64_t stamp_us :
       {std::numeric_limits<std::int64_t>::min(), std::int64_t{-1}, std::int64_t{0},
        (now_ns_ + wall_minus_ns_ - kSecond) / kUs, (now_ns_ + wall_minus_ns_ + kSecond) / kUs,
        std::numeric_limits<std::int64_t>::max()}) {
    pass();
    EXPECT_EQ(clock_.arrival_ns(stamp_us), now_ns_) << stamp_us;
  }
}

}  // namespace
}  // namespace softarm
