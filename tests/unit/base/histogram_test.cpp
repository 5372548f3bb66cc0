// Durations in half-octaves, and the deadlines they are measured against.
#include "softarm/base/histogram.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "softarm/base/clock.hpp"
#include "softarm/base/instance_lock.hpp"

namespace softarm {
namespace {

int bucket_of(std::int64_t duration_ns) {
  DurationHistogram histogram;
  histogram.add_ns(duration_ns);
  const auto& counts = histogram.counts();
  EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), 0), 1);
  for (int k = 0; k < kDurationBuckets; ++k)
    if (counts[static_cast<std::size_t>(k)] == 1) return k;
  return -1;
}

TEST(Histogram, EdgesAreHalfOctaves) {
  for (int k = 0; k < kDurationBuckets; ++k)
    EXPECT_NEAR(bucket_edge_us(k), std::exp2(0.5 * k), 1e-9 * std::exp2(0.5 * k));
}

TEST(Histogram, EveryDurationFallsIntoTheBucketWhoseEdgesEncloseIt) {
  std::mt19937_64 random(3);
  for (int k = 0; k < 100'000; ++k) {
    const double octave = std::uniform_real_distribution<double>(0.0, 40.0)(random);
    const auto duration_ns = static_cast<std::int64_t>(std::exp2(octave));
    const double us = 1e-3 * static_cast<double>(duration_ns);
    const int bucket = bucket_of(duration_ns);
    ASSERT_TRUE(bucket == 0 || us >= bucket_edge_us(bucket)) << duration_ns;
    ASSERT_TRUE(bucket == kDurationBuckets - 1 || us < bucket_edge_us(bucket + 1)) << duration_ns;
  }
}

TEST(Histogram, TheEndsTakeWhatLiesBeyond) {
  EXPECT_EQ(bucket_of(0), 0);
  EXPECT_EQ(bucket_of(999), 0);
  EXPECT_EQ(bucket_of(1000), 0);
  EXPECT_EQ(bucket_of(2000), 2);
  EXPECT_EQ(bucket_of(-5), 0);
  EXPECT_EQ(bucket_of(std::numeric_limits<std::int64_t>::min()), 0);
  EXPECT_EQ(bucket_of(std::numeric_limits<std::int64_t>::max()), kDurationBuckets - 1);
}

TEST(Histogram, LargestIsKept) {
  DurationHistogram histogram;
  EXPECT_EQ(histogram.max_us(), 0.0);
  for (const std::int64_t ns : {5'000, 1'234'567, 7}) histogram.add_ns(ns);
  EXPECT_DOUBLE_EQ(histogram.max_us(), 1234.567);
}

TEST(Histogram, QuantilesAreUpperEdgesOfTheirBucket) {
  DurationHistogram histogram;
  EXPECT_EQ(quantile_us(histogram.counts(), 0.5), 0.0) << "empty";
  for (int k = 0; k < 90; ++k) histogram.add_ns(3'000);    // bucket 3: 2.83 to 4 us
  for (int k = 0; k < 10; ++k) histogram.add_ns(100'000);  // bucket 13: 90.5 to 128 us
  EXPECT_DOUBLE_EQ(quantile_us(histogram.counts(), 0.5), 4.0);
  EXPECT_DOUBLE_EQ(quantile_us(histogram.counts(), 0.9), 4.0);
  EXPECT_DOUBLE_EQ(quantile_us(histogram.counts(), 0.91), 128.0);
  EXPECT_DOUBLE_EQ(quantile_us(histogram.counts(), 1.0), 128.0);
}

// A quantile of random durations, by sorting them.
TEST(Histogram, QuantilesEncloseThoseOfTheSortedDurations) {
  std::mt19937 random(11);
  std::lognormal_distribution<double> durations_us(3.0, 1.0);
  std::vector<double> all;
  DurationHistogram histogram;
  for (int k = 0; k < 10'000; ++k) {
    const auto ns = static_cast<std::int64_t>(1e3 * durations_us(random));
    histogram.add_ns(ns);
    all.push_back(1e-3 * static_cast<double>(ns));
  }
  std::sort(all.begin(), all.end());
  for (const double fraction : {0.01, 0.5, 0.9, 0.99, 0.999}) {
    const double exact = all[static_cast<std::size_t>(fraction * 10'000) - 1];
    const double reported = quantile_us(histogram.counts(), fraction);
    EXPECT_GE(reported, exact) << fraction;
    EXPECT_LE(reported, std::max(std::sqrt(2.0), exact * std::sqrt(2.0) * (1 + 1e-9))) << fraction;
  }
}

TEST(PeriodicDeadline, StaysOnItsGridAndSkipsWhatWasMissed) {
  PeriodicDeadline deadline(1000, 500);
  EXPECT_EQ(deadline.next_ns(), 500);
  EXPECT_EQ(deadline.advance(700), 0);
  EXPECT_EQ(deadline.next_ns(), 1500);
  EXPECT_EQ(deadline.advance(2500), 0) << "exactly in time for the next";
  EXPECT_EQ(deadline.next_ns(), 2500);
  EXPECT_EQ(deadline.advance(3501), 1) << "a nanosecond too late for the next";
  EXPECT_EQ(deadline.next_ns(), 4500);
  EXPECT_EQ(deadline.advance(1'000'000'499), 999'995);
  EXPECT_EQ(deadline.next_ns(), 1'000'000'500);
}

// Whatever time the work takes: deadlines and misses together account for every period, and the
// next one is never in the past.
TEST(PeriodicDeadline, NoPeriodIsLostOrServedTwice) {
  std::mt19937_64 random(5);
  constexpr std::int64_t kPeriod = 2'000'000, kStart = 123'456'789;
  PeriodicDeadline deadline(kPeriod, kStart);
  std::int64_t now_ns = kStart, served = 0, missed = 0;
  for (int k = 0; k < 10'000; ++k) {
    now_ns = std::max(now_ns, deadline.next_ns());  // sleeps until then
    ++served;
    now_ns += static_cast<std::int64_t>(
        std::exp(std::uniform_real_distribution<double>(0.0, 18.0)(random)));
    const std::int64_t skipped = deadline.advance(now_ns);
    ASSERT_GE(skipped, 0);
    missed += skipped;
    ASSERT_GE(deadline.next_ns(), now_ns);
    ASSERT_LE(deadline.next_ns(), now_ns + kPeriod);
    ASSERT_EQ(deadline.next_ns(), kStart + (served + missed) * kPeriod);
  }
  EXPECT_GT(missed, 1000);
}

TEST(MonotonicClock, SleepsToAnAbsoluteTime) {
  const std::int64_t wake_ns = monotonic_now_ns() + 3'000'000;
  while (monotonic_now_ns() < wake_ns) sleep_until_ns(wake_ns);
  sleep_until_ns(wake_ns - 1'000'000'000);  // in the past: returns
  EXPECT_GE(monotonic_now_ns(), wake_ns);
}

TEST(InstanceLock, ASecondHolderIsRefusedUntilTheFirstIsGone) {
  const std::string name = "test of process " + std::to_string(monotonic_now_ns());
  {
    InstanceLock first(name);
    EXPECT_THROW(InstanceLock second(name), std::runtime_error);
    InstanceLock other(name + " other");
  }
  InstanceLock again(name);
}

// The kernel takes 107 bytes: names that begin alike, of two arms, must not exclude each other.
TEST(InstanceLock, LongNamesAreDistinguishedByTheirEnds) {
  const std::string begin = "test of " + std::to_string(monotonic_now_ns()) + std::string(200, 'x');
  for (const std::size_t length : {80, 98, 99, 100, 101, 150, 200}) {
    const std::string name = begin.substr(0, length);
    InstanceLock first(name + "1");
    InstanceLock second(name + "2");
    InstanceLock longer(name + "11");
    EXPECT_THROW(InstanceLock again(name + "1"), OtherInstance) << length;
    EXPECT_THROW(InstanceLock again(name + "11"), OtherInstance) << length;
  }
}

}  // namespace
}  // namespace softarm
