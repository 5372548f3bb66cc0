#include "softarm/estimation/clock_relation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {

// A sender on a network: true capture times on our clock, stamps on its own, arrivals after a
// latency and jitter.
struct Network {
  double drift = 0.0;                       // of the sender's clock
  std::int64_t ahead_ns = 987'654'321'000;  // of the sender's clock at time 0
  std::int64_t latency_ns = 5'000'000;
  double jitter_s = 2e-3;  // mean of an exponential
  std::mt19937_64 random{11};
  std::int64_t last_arrival_ns = 0;

  std::int64_t stamp_us(std::int64_t true_ns) const {
    return (true_ns + std::llround(drift * static_cast<double>(true_ns)) + ahead_ns) / 1000;
  }
  std::int64_t arrival_ns(std::int64_t true_ns) {
    std::exponential_distribution<double> jitter(1.0 / jitter_s);
    last_arrival_ns = std::max(last_arrival_ns, true_ns + latency_ns + to_ns(jitter(random)));
    return last_arrival_ns;
  }
};

TEST(ClockRelation, SeesThroughJitterAndDrift) {
  for (const double drift : {0.0, 100e-6, -100e-6}) {
    Network network;
    network.drift = drift;
    ClockRelation relation(ClockMode::sender, 5e-3);
    double worst_s = 0.0;
    for (std::int64_t k = 0; k < 20'000; ++k) {  // 100 s at 200 Hz
      const std::int64_t captured = k * 5'000'000;
      const std::int64_t arrival = network.arrival_ns(captured);
      const std::int64_t mapped_ns = relation.capture_ns(arrival, network.stamp_us(captured));
      ASSERT_LE(mapped_ns, arrival);
      if (k >= 400)
        worst_s = std::max(worst_s, 1e-9 * std::abs(static_cast<double>(mapped_ns - captured)));
    }
    EXPECT_LT(worst_s, 0.25e-3) << "drift " << drift;
    EXPECT_EQ(relation.clock_jumps(), 0);
  }
}

TEST(ClockRelation, AJumpOfTheSendersClockDoesNoHarm) {
  for (const double jump_s : {-3600.0, -1.0, -0.05, 0.05, 1.0, 1e6}) {
    Network network;
    ClockRelation relation(ClockMode::sender, 5e-3);
    double worst_s = 0.0;
    for (std::int64_t k = 0; k < 4000; ++k) {
      if (k == 2000) network.ahead_ns += to_ns(jump_s);
      const std::int64_t captured = k * 5'000'000;
      const std::int64_t arrival = network.arrival_ns(captured);
      const std::int64_t mapped_ns = relation.capture_ns(arrival, network.stamp_us(captured));
      ASSERT_LE(mapped_ns, arrival);
      if (k >= 400)
        worst_s = std::max(worst_s, 1e-9 * std::abs(static_cast<double>(mapped_ns - captured)));
    }
    // No worse than the jitter of the frame in which the clock jumped.
    EXPECT_LT(worst_s, 15e-3) << "jump " << jump_s;
    EXPECT_EQ(relation.clock_jumps(), jump_s < 0.0 ? 1 : 0);
  }
}

TEST(ClockRelation, ALateFrameIsRecognisedAsLate) {
  ClockRelation relation(ClockMode::sender, 2e-3);
  for (std::int64_t k = 0; k < 100; ++k) {
    relation.capture_ns(k * 5'000'000 + 2'000'000, k * 5000);
  }
  EXPECT_EQ(relation.capture_ns(100 * 5'000'000 + 300'000'000, 100 * 5000), 100 * 5'000'000);
}

TEST(ClockRelation, ForgetsWhatIsOlderThanTwoSeconds) {
  ClockRelation relation(ClockMode::sender, 0.0);
  EXPECT_EQ(relation.capture_ns(1'000'000'000, 1'000'000), 1'000'000'000);
  // From now on the path takes 50 ms more; for two seconds that reads as lateness, then as the
  // least latency.
  std::int64_t mapped_ns = 0;
  for (std::int64_t k = 1; k <= 30; ++k) {
    mapped_ns = relation.capture_ns(1'050'000'000 + k * 100'000'000, 1'000'000 + k * 100'000);
    const std::int64_t captured = 1'000'000'000 + k * 100'000'000;
    if (k < 17) {
      EXPECT_EQ(mapped_ns, captured) << k;
    }
  }
  EXPECT_EQ(mapped_ns, 1'050'000'000 + 30 * 100'000'000LL);
  relation.reset();
  EXPECT_EQ(relation.capture_ns(9'000'000'000, 42), 9'000'000'000);
}

TEST(ClockRelation, LatencyModeAndNonsenseStampsGoByTheArrival) {
  ClockRelation relation(ClockMode::latency, 4e-3);
  EXPECT_EQ(relation.capture_ns(10'000'000, 123456), 6'000'000);
  ClockRelation sender(ClockMode::sender, 4e-3);
  for (const std::int64_t stamp :
       {std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min()}) {
    EXPECT_EQ(sender.capture_ns(10'000'000, stamp), 6'000'000);
  }
  EXPECT_EQ(sender.capture_ns(10'000'000, -4'000'000'000'000'000), 6'000'000);
}

TEST(ClockRelation, RefusesANegativeLatency) {
  EXPECT_THROW(ClockRelation(ClockMode::sender, -1e-3), std::invalid_argument);
  EXPECT_THROW(ClockRelation(ClockMode::sender, std::numeric_limits<double>::quiet_NaN()),
               std::invalid_argument);
}

TEST(ClockRelation, TheOriginOfOurClockDoesNotMatter) {
  const auto captures_from = [](std::int64_t start_ns) {
    Network network;
    ClockRelation relation(ClockMode::sender, 5e-3);
    std::vector<std::int64_t> captures;
    for (std::int64_t k = 0; k < 2000; ++k) {
      const std::int64_t captured = k * 5'000'000;
      captures.push_back(
          relation.capture_ns(start_ns + network.arrival_ns(captured), network.stamp_us(captured)) -
          start_ns);
    }
    return captures;
  };
  const std::vector<std::int64_t> expected = captures_from(0);
  for (const std::int64_t start_s : {-1'000'000, -12, -4, 2, 1'000'000})  // whole windows of 2 s
    EXPECT_TRUE(captures_from(start_s * 1'000'000'000) == expected) << start_s;
}

}  // namespace
}  // namespace softarm
