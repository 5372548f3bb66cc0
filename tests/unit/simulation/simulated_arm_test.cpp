// Valves, arm and motion capture together: what happens when.
#include "softarm/simulation/simulated_arm.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "milliseconds.hpp"
#include "softarm/base/time.hpp"
#include "unit/simulation/paper_arm.hpp"

namespace softarm {
namespace {

using test::kMs;
constexpr std::int64_t kFirst_ns = 987'654'321'012'345;

PlantSettings sensed_arm() {
  PlantSettings settings = paper_arm();
  settings.valves.lag_s = 0.02;
  settings.mocap = {.rate_hz = 200.0,
                    .latency_s = 0.005,
                    .position_noise_m = 0.2e-3,
                    .orientation_noise_rad = 3.5e-3,
                    .dropout_probability = 0.05};
  return settings;
}

PressureCommand hold(std::int64_t sequence, const std::vector<double>& pressures) {
  return {.sequence = sequence, .validity_ns = 100 * kMs, .pressure_bar = pressures};
}

TEST(SimulatedArm, IsVentedAndSeesItsFirstFrameAtTheStart) {
  PlantSettings settings = sensed_arm();
  settings.mocap.dropout_probability = 0.0;
  SimulatedArm arm(settings, kFirst_ns);
  MocapFrame frame;
  EXPECT_TRUE(arm.vented());
  EXPECT_EQ(arm.sequence(), CommandExpiry::kNoSequence);
  EXPECT_FALSE(arm.receive(frame));
  EXPECT_EQ(arm.next_event_ns(), kFirst_ns + 5 * kMs);
  arm.advance_to(kFirst_ns + 5 * kMs - 1);
  EXPECT_FALSE(arm.receive(frame));
  arm.advance_to(kFirst_ns + 5 * kMs);
  ASSERT_TRUE(arm.receive(frame));
  EXPECT_EQ(frame.frame_number, 0);
  EXPECT_EQ(frame.capture_ns, kFirst_ns);
  EXPECT_EQ(frame.segments, 3);
  EXPECT_FALSE(arm.receive(frame));
}

TEST(SimulatedArm, VentsWhenCommandsStop) {
  SimulatedArm arm(sensed_arm(), kFirst_ns);
  const std::vector<double> pressures = drive_bar(1.0);
  ASSERT_EQ(arm.command(hold(1, pressures), kFirst_ns + 10 * kMs), CommandVerdict::in_force);
  EXPECT_EQ(arm.sequence(), 1);
  arm.advance_to(kFirst_ns + 110 * kMs - 1);
  EXPECT_FALSE(arm.vented());
  arm.advance_to(kFirst_ns + 150 * kMs);
  EXPECT_TRUE(arm.vented());
  // Up for 100 ms, down for 40 ms with a lag of 20 ms, although nothing was called at the expiry.
  for (Eigen::Index i = 0; i < 12; ++i) {
    const double top = pressures[static_cast<std::size_t>(i)] * (1.0 - std::exp(-5.0));
    EXPECT_NEAR(arm.measured_pressures_bar()[i], top * std::exp(-2.0), 1e-9);
  }
  arm.advance_to(kFirst_ns + 8000 * kMs);
  EXPECT_LT(arm.measured_pressures_bar().maxCoeff(), 1e-12);
  EXPECT_LT(arm.plant().u_rad().norm(), 1e-4);
}

TEST(SimulatedArm, ShadowAndOldCommandsChangeNothing) {
  SimulatedArm arm(sensed_arm(), kFirst_ns);
  SimulatedArm same(sensed_arm(), kFirst_ns);
  const std::vector<double> pressures = drive_bar(1.0);
  const std::vector<double> others(12, 1.5);
  arm.command(hold(5, pressures), kFirst_ns);
  same.command(hold(5, pressures), kFirst_ns);
  PressureCommand shadow = hold(6, others);
  shadow.shadow = true;
  EXPECT_EQ(arm.command(shadow, kFirst_ns + 20 * kMs), CommandVerdict::shadow);
  EXPECT_EQ(arm.command(hold(4, others), kFirst_ns + 30 * kMs), CommandVerdict::older);
  EXPECT_EQ(arm.command(hold(7, std::vector<double>(11, 0.0)), kFirst_ns + 30 * kMs),
            CommandVerdict::malformed);
  same.advance_to(kFirst_ns + 20 * kMs);
  same.advance_to(kFirst_ns + 30 * kMs);
  arm.advance_to(kFirst_ns + 90 * kMs);
  same.advance_to(kFirst_ns + 90 * kMs);
  EXPECT_EQ(arm.plant().u_rad(), same.plant().u_rad());
}

TEST(SimulatedArm, FramesShowTheArmAtTheInstantOfCapture) {
  PlantSettings settings = sensed_arm();
  settings.mocap = {.rate_hz = 240.0, .latency_s = 0.011};
  settings.initial_u_rad.setZero(6);
  settings.initial_u_rad[0] = 0.5;
  SimulatedArm arm(settings, kFirst_ns);
  // Called at times that have nothing to do with the captures.
  std::vector<MocapFrame> frames;
  MocapFrame frame;
  for (std::int64_t now = kFirst_ns; now < kFirst_ns + 300 * kMs; now += 7'777'777) {
    arm.advance_to(now);
    while (arm.receive(frame)) {
      EXPECT_LE(frame.capture_ns + 11 * kMs, now);
      EXPECT_GT(frame.capture_ns + 11 * kMs, now - 7'777'777);
      frames.push_back(frame);
    }
  }
  ASSERT_GT(frames.size(), 60u);
  ArmPlant truth(settings);
  std::vector<Eigen::Isometry3d> ends(3);
  for (const MocapFrame& seen : frames) {
    truth.advance(to_seconds(seen.capture_ns - kFirst_ns));
    truth.segment_ends(ends);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_LT((seen.body[i + 1].position_m - ends[i].translation()).norm(), 1e-6);
      EXPECT_LT((seen.body[i + 1].orientation.toRotationMatrix() - ends[i].linear()).norm(), 1e-5);
    }
  }
}

TEST(SimulatedArm, NamesItsNextEvent) {
  PlantSettings settings = sensed_arm();
  settings.mocap = {.rate_hz = 10.0, .latency_s = 0.03};
  SimulatedArm arm(settings, kFirst_ns);
  EXPECT_EQ(arm.next_event_ns(), kFirst_ns + 30 * kMs);  // arrival of the first frame
  arm.advance_to(kFirst_ns + 30 * kMs);
  MocapFrame frame;
  ASSERT_TRUE(arm.receive(frame));
  EXPECT_EQ(arm.next_event_ns(), kFirst_ns + 100 * kMs);  // next capture
  const std::vector<double> pressures(12, 0.1);
  PressureCommand command = hold(1, pressures);
  command.validity_ns = 40 * kMs;
  arm.command(command, kFirst_ns + 40 * kMs);
  EXPECT_EQ(arm.next_event_ns(), kFirst_ns + 80 * kMs);  // expiry
}

TEST(SimulatedArm, TimeDoesNotGoBack) {
  SimulatedArm arm(sensed_arm(), kFirst_ns);
  arm.advance_to(kFirst_ns + 50 * kMs);
  const SegmentVector u = arm.plant().u_rad();
  arm.advance_to(kFirst_ns + 20 * kMs);
  EXPECT_EQ(arm.time_ns(), kFirst_ns + 50 * kMs);
  const std::vector<double> pressures(12, 0.1);
  EXPECT_EQ(arm.command(hold(1, pressures), kFirst_ns + 49 * kMs), CommandVerdict::in_force);
  arm.advance_to(kFirst_ns + 150 * kMs - 1);  // valid for 100 ms from when it was taken
  EXPECT_FALSE(arm.vented());
  EXPECT_EQ(u.size(), 6);
}

TEST(SimulatedArm, SameSeedSameBitsOtherSeedOtherNoiseOnly) {
  const auto run = [](std::uint64_t seed) {
    PlantSettings settings = sensed_arm();
    settings.seed = seed;
    SimulatedArm arm(settings, 0);
    std::vector<double> trace;
    MocapFrame frame;
    for (int k = 0; k < 500; ++k) {
      const std::int64_t now = 2 * kMs * k;
      const std::vector<double> pressures = drive_bar(2e-3 * k);
      arm.command(hold(k, pressures), now);
      while (arm.receive(frame)) {
        trace.push_back(frame.body[3].position_m[0]);
        trace.push_back(frame.body[2].orientation.x());
      }
    }
    return std::pair(trace, arm.plant().u_rad());
  };
  const auto one = run(1);
  const auto same = run(1);
  const auto other = run(2);
  EXPECT_GT(one.first.size(), 100u);
  EXPECT_EQ(one.first, same.first);
  EXPECT_EQ(one.second, same.second);
  EXPECT_NE(one.first, other.first);
  EXPECT_EQ(one.second, other.second);
}

TEST(SimulatedArm, LongerTicksThanFramePeriodsLoseNoFrame) {
  PlantSettings settings = sensed_arm();
  settings.mocap.dropout_probability = 0.0;
  SimulatedArm arm(settings, 0);
  MocapFrame frame;
  std::int64_t next = 0;
  for (int k = 1; k <= 50; ++k) {
    arm.advance_to(20 * kMs * k);  // 50 Hz control, 200 Hz frames
    while (arm.receive(frame)) EXPECT_EQ(frame.frame_number, next++);
  }
  EXPECT_EQ(next, 200);
  EXPECT_EQ(arm.mocap().overwritten(), 0);
}

}  // namespace
}  // namespace softarm
