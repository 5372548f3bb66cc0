#include "softarm/simulation/mocap_simulator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kStart = 123'456'789'000'000;

Eigen::Isometry3d pose(double x) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(0.3 + x, Eigen::Vector3d(1, 2, -1).normalized()).matrix();
  pose.translation() = Eigen::Vector3d(x, -0.2, 0.1 * x);
  return pose;
}

std::vector<MocapFrame> record(const MocapSettings& settings, std::uint64_t seed, int captures) {
  MocapSimulator mocap(settings, 2, seed, kStart);
  const std::vector<Eigen::Isometry3d> ends{pose(0.1), pose(0.7)};
  std::vector<MocapFrame> frames;
  MocapFrame frame;
  for (int k = 0; k < captures; ++k) {
    mocap.capture(pose(0.0), ends);
    while (mocap.receive(INT64_MAX - 1, frame)) frames.push_back(frame);
  }
  return frames;
}

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& q) {
  const Eigen::AngleAxisd turn(q);
  return turn.angle() * turn.axis();
}

TEST(MocapSimulator, WithoutNoiseReportsTheTruth) {
  const auto frames = record({}, 1, 3);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[2].segments, 2);
  for (int i = 0; i < 3; ++i) {
    const BodyPose& body = frames[2].body[static_cast<std::size_t>(i)];
    const Eigen::Isometry3d truth = pose(i == 0 ? 0.0 : i == 1 ? 0.1 : 0.7);
    EXPECT_TRUE(body.valid);
    EXPECT_EQ(body.position_m, truth.translation());
    EXPECT_LT((body.orientation.toRotationMatrix() - truth.linear()).norm(), 1e-14);
    EXPECT_NEAR(body.orientation.norm(), 1.0, 1e-15);
  }
}

TEST(MocapSimulator, CapturesAtItsRateWithoutDrift) {
  MocapSettings settings;
  settings.rate_hz = 240.0;  // whose period is not a whole number of nanoseconds
  MocapSimulator mocap(settings, 1, 1, kStart);
  const std::vector<Eigen::Isometry3d> ends{pose(0.1)};
  EXPECT_EQ(mocap.next_capture_ns(), kStart);
  for (int k = 0; k < 240 * 60; ++k) {
    const long double exact = 1e9L * k / 240.0L;
    ASSERT_LE(std::fabs(static_cast<double>(
                  static_cast<long double>(mocap.next_capture_ns() - kStart) - exact)),
              0.51);
    mocap.capture(pose(0.0), ends);
  }
  EXPECT_EQ(mocap.next_capture_ns(), kStart + 60'000'000'000);
}

TEST(MocapSimulator, FramesArriveAfterTheLatencyInOrder) {
  MocapSettings settings;
  settings.rate_hz = 1000.0;
  settings.latency_s = 0.0075;
  MocapSimulator mocap(settings, 1, 1, kStart);
  const std::vector<Eigen::Isometry3d> ends{pose(0.1)};
  MocapFrame frame;
  EXPECT_EQ(mocap.next_arrival_ns(), kForever);
  std::int64_t received = 0;
  for (std::int64_t now = kStart; now < kStart + 100'000'000; now += 500'000) {
    if (now == mocap.next_capture_ns()) mocap.capture(pose(0.0), ends);
    while (mocap.receive(now, frame)) {
      EXPECT_EQ(frame.frame_number, received);
      EXPECT_EQ(now - frame.capture_ns, 7'500'000);
      ++received;
    }
  }
  EXPECT_EQ(received, 93);  // captured from 0 to 99 ms, arrived by 99.5 ms
  EXPECT_EQ(mocap.overwritten(), 0);
}

TEST(MocapSimulator, NoiseHasTheStandardDeviationAskedFor) {
  MocapSettings settings;
  settings.position_noise_m = 0.2e-3;
  settings.orientation_noise_rad = 3.5e-3;
  const auto frames = record(settings, 42, 20000);
  const Eigen::Isometry3d truth[] = {pose(0.0), pose(0.1), pose(0.7)};
  for (std::size_t body = 0; body < 3; ++body) {
    Eigen::Vector3d p1 = Eigen::Vector3d::Zero(), p2 = p1, r1 = p1, r2 = p1;
    double cross = 0.0;
    for (const MocapFrame& frame : frames) {
      const Eigen::Vector3d p = frame.body[body].position_m - truth[body].translation();
      const Eigen::Vector3d r = rotation_vector(
          Eigen::Quaterniond(truth[body].linear()).conjugate() * frame.body[body].orientation);
      p1 += p;
      p2 += p.cwiseAbs2();
      r1 += r;
      r2 += r.cwiseAbs2();
      cross += p[0] * p[1] / (0.2e-3 * 0.2e-3);
    }
    const double n = static_cast<double>(frames.size());
    for (int axis = 0; axis < 3; ++axis) {
      // Six standard deviations of the estimate: sigma / sqrt(2 n) for sigma, sigma / sqrt(n) for
      // the mean.
      EXPECT_NEAR(std::sqrt(p2[axis] / n) / 0.2e-3, 1.0, 6.0 / std::sqrt(2.0 * n));
      EXPECT_NEAR(std::sqrt(r2[axis] / n) / 3.5e-3, 1.0, 6.0 / std::sqrt(2.0 * n));
      EXPECT_NEAR(p1[axis] / n / 0.2e-3, 0.0, 6.0 / std::sqrt(n));
      EXPECT_NEAR(r1[axis] / n / 3.5e-3, 0.0, 6.0 / std::sqrt(n));
    }
    EXPECT_NEAR(cross / n, 0.0, 6.0 / std::sqrt(n));
  }
}

TEST(MocapSimulator, TheBaseIsNoisyOnlyIfAskedTo) {
  MocapSettings settings;
  settings.position_noise_m = 1e-3;
  settings.orientation_noise_rad = 1e-3;
  settings.noise_on_base = false;
  const auto frames = record(settings, 1, 10);
  EXPECT_EQ(frames[9].body[0].position_m, pose(0.0).translation());
  EXPECT_NE(frames[9].body[1].position_m, pose(0.1).translation());
}

TEST(MocapSimulator, DropsFramesWithTheProbabilityAskedFor) {
  MocapSettings settings;
  settings.dropout_probability = 0.1;
  const auto frames = record(settings, 3, 50000);
  const double dropped = 1.0 - static_cast<double>(frames.size()) / 50000.0;
  EXPECT_NEAR(dropped, 0.1, 6.0 * std::sqrt(0.09 / 50000.0));
  // Independent from frame to frame: a drop after a drop is as likely as any other.
  int pairs = 0;
  for (std::size_t k = 1; k < frames.size(); ++k) {
    const std::int64_t gap = frames[k].frame_number - frames[k - 1].frame_number;
    pairs += static_cast<int>(std::max<std::int64_t>(gap - 2, 0));
  }
  EXPECT_NEAR(pairs / 50000.0, 0.01, 6.0 * std::sqrt(0.01 / 50000.0));
  settings.dropout_probability = 1.0;
  EXPECT_TRUE(record(settings, 3, 100).empty());
}

TEST(MocapSimulator, SameSeedSameBitsOtherSeedOthers) {
  MocapSettings settings;
  settings.position_noise_m = 1e-3;
  settings.orientation_noise_rad = 1e-2;
  settings.dropout_probability = 0.2;
  const auto one = record(settings, 7, 200);
  const auto same = record(settings, 7, 200);
  const auto other = record(settings, 8, 200);
  ASSERT_EQ(one.size(), same.size());
  for (std::size_t k = 0; k < one.size(); ++k) {
    EXPECT_EQ(one[k].frame_number, same[k].frame_number);
    EXPECT_EQ(one[k].body[2].position_m, same[k].body[2].position_m);
    EXPECT_EQ(one[k].body[2].orientation.coeffs(), same[k].body[2].orientation.coeffs());
  }
  EXPECT_NE(one[0].body[1].position_m, other[0].body[1].position_m);
}

TEST(MocapSimulator, DropoutsDoNotDependOnNoise) {
  MocapSettings settings;
  settings.dropout_probability = 0.3;
  const auto clean = record(settings, 5, 300);
  settings.position_noise_m = 1e-3;
  const auto noisy = record(settings, 5, 300);
  ASSERT_EQ(clean.size(), noisy.size());
  for (std::size_t k = 0; k < clean.size(); ++k) {
    EXPECT_EQ(clean[k].frame_number, noisy[k].frame_number);
  }
}

TEST(MocapSimulator, WhatNobodyFetchesIsLostOldestFirst) {
  MocapSimulator mocap({}, 1, 1, kStart);
  const std::vector<Eigen::Isometry3d> ends{pose(0.1)};
  for (int k = 0; k < 1000; ++k) mocap.capture(pose(0.0), ends);
  EXPECT_EQ(mocap.overwritten(), 1000 - MocapSimulator::kSlack);
  MocapFrame frame;
  ASSERT_TRUE(mocap.receive(INT64_MAX - 1, frame));
  EXPECT_EQ(frame.frame_number, 1000 - MocapSimulator::kSlack);
}

TEST(MocapSimulator, RefusesSettingsThatMeanNothing) {
  const auto build = [](auto change) {
    MocapSettings settings;
    change(settings);
    MocapSimulator(settings, 1, 1, 0);
  };
  EXPECT_THROW(build([](auto& s) { s.rate_hz = 0.0; }), std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.rate_hz = std::nan(""); }), std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.latency_s = -1.0; }), std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.latency_s = 1e9; }), std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.position_noise_m = -1.0; }), std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.orientation_noise_rad = INFINITY; }), std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.dropout_probability = 1.5; }), std::invalid_argument);
  EXPECT_THROW(MocapSimulator({}, 0, 1, 0), std::invalid_argument);
  EXPECT_THROW(MocapSimulator({}, kMaxSegments + 1, 1, 0), std::invalid_argument);
}

TEST(RandomNumbers, AreThePublishedGenerator) {
  // splitmix64 of 0 starts with e220a8397b1dcdaf, which is what stream 0 mixes into the seed; the
  // state then is splitmix64 of that. Written out by hand for xoshiro256++'s first output: rotl(s0
  // + s3, 23) + s0.
  const auto next = [](std::uint64_t& x) {
    x += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = x;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  };
  std::uint64_t zero = 0;
  ASSERT_EQ(next(zero), 0xe220a8397b1dcdafULL);
  std::uint64_t state = 5 ^ 0xe220a8397b1dcdafULL;
  const std::uint64_t s0 = next(state);
  next(state);
  next(state);
  const std::uint64_t s3 = next(state);
  const std::uint64_t sum = s0 + s3;
  EXPECT_EQ(RandomNumbers(5).bits(), ((sum << 23) | (sum >> 41)) + s0);
}

TEST(RandomNumbers, NormalNumbersHaveTheMomentsAndTailsOfOne) {
  RandomNumbers random(1, 2);
  const int n = 1'000'000;
  double m1 = 0.0, m2 = 0.0, m3 = 0.0, m4 = 0.0;
  int beyond = 0;
  for (int k = 0; k < n; ++k) {
    const double z = random.normal();
    m1 += z;
    m2 += z * z;
    m3 += z * z * z;
    m4 += z * z * z * z;
    beyond += std::abs(z) > 2.0 ? 1 : 0;
  }
  EXPECT_NEAR(m1 / n, 0.0, 6e-3);
  EXPECT_NEAR(m2 / n, 1.0, 6.0 * std::sqrt(2.0 / n));
  EXPECT_NEAR(m3 / n, 0.0, 6.0 * std::sqrt(15.0 / n));
  EXPECT_NEAR(m4 / n, 3.0, 6.0 * std::sqrt(96.0 / n));
  EXPECT_NEAR(beyond / static_cast<double>(n), 0.0455003, 6.0 * std::sqrt(0.0455 / n));
}

}  // namespace
}  // namespace softarm
