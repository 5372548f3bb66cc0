#include "softarm/runtime/safety_monitor.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "milliseconds.hpp"
#include "softarm/base/time.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {
namespace {

using test::kMs;
constexpr double kTickPeriod_s = 0.002;

/// Steps time by hand: 500 Hz ticks, 200 Hz frames of 5 ms latency unless a test says otherwise.
class MonitorBench {
 public:
  explicit MonitorBench(Arming arming = Arming::automatic, bool readback = false)
      : monitor(
            [&] {
              SafetySettings settings;
              settings.arming = arming;
              settings.frame_latency_s = 0.005;
              settings.valve_readback = readback;
              return settings;
            }(),
            kTickPeriod_s) {}

  Mode tick(std::int64_t step_ns = 2 * kMs) {
    input.now_ns += step_ns;
    input.good_frames = frames_per_tick;
    if (frames_per_tick > 0) input.newest_capture_ns = input.now_ns - 5 * kMs;
    input.newest_measurement_ns = input.now_ns;
    const Mode mode = monitor.step(input);
    input.requests.arm = input.requests.disarm = false;
    input.bad_frames = 0;
    input.sender_restarted = false;
    return mode;
  }
  Mode run(int ticks) {
    for (int k = 0; k < ticks; ++k) tick();
    return monitor.mode();
  }
  void activate() {
    input.fully_vented = true;
    run(60);
    ASSERT_EQ(monitor.mode(), Mode::active);
    input.fully_vented = false;
  }

  SafetyMonitor monitor;
  SafetyInput input{.now_ns = 1'000'000'000};
  int frames_per_tick = 1;
};

TEST(SafetyMonitor, ThresholdsFollowTheirRule) {
  SafetySettings settings;
  settings.frame_period_s = 0.005;
  settings.frame_latency_s = 0.005;
  auto thresholds = resolve_thresholds(settings, 0.002);
  EXPECT_EQ(thresholds.hold_after_ns, 20 * kMs);
  EXPECT_EQ(thresholds.vent_after_ns, 100 * kMs);
  settings.frame_period_s = 0.125;
  thresholds = resolve_thresholds(settings, 0.02);
  EXPECT_EQ(thresholds.hold_after_ns, 380 * kMs);
  EXPECT_EQ(thresholds.vent_after_ns, 1250 * kMs);
  settings.hold_after_s = 0.05;
  EXPECT_EQ(resolve_thresholds(settings, 0.02).hold_after_ns, 50 * kMs);
}

TEST(SafetyMonitor, WaitsForFiftyGoodFramesInARow) {
  MonitorBench bench;
  bench.input.fully_vented = true;
  bench.run(49);
  EXPECT_EQ(bench.monitor.mode(), Mode::wait_frames);
  bench.input.bad_frames = 1;
  bench.tick();
  EXPECT_EQ(bench.run(49), Mode::wait_frames);
  EXPECT_EQ(bench.run(1), Mode::active);
}

TEST(SafetyMonitor, ExplicitArmingWaitsForTheOperator) {
  MonitorBench bench(Arming::explicit_);
  bench.input.fully_vented = true;
  EXPECT_EQ(bench.run(200), Mode::wait_frames);
  EXPECT_EQ(bench.monitor.reason(), Reason::waiting_for_arm);
  bench.input.requests.arm = true;
  EXPECT_EQ(bench.tick(), Mode::active);
}

TEST(SafetyMonitor, SilenceHoldsThenVentsAndComesBack) {
  MonitorBench bench;
  bench.activate();
  bench.frames_per_tick = 0;  // the age is 5 ms at the last frame and grows by 2 ms a tick
  EXPECT_EQ(bench.run(7), Mode::active);
  EXPECT_EQ(bench.run(1), Mode::hold);
  EXPECT_EQ(bench.monitor.reason(), Reason::frames_late);
  EXPECT_EQ(bench.run(39), Mode::hold);
  EXPECT_EQ(bench.run(1), Mode::vent);
  EXPECT_EQ(bench.monitor.reason(), Reason::frames_stale);
  bench.frames_per_tick = 1;
  EXPECT_EQ(bench.run(200), Mode::vent) << "must not leave before it is fully vented";
  bench.input.fully_vented = true;
  EXPECT_EQ(bench.run(49), Mode::vent) << "the arm swings until it has been vented for a while";
  EXPECT_EQ(bench.run(1), Mode::active);
}

TEST(SafetyMonitor, ASoftLimitIsNotForgivenAutomatically) {
  MonitorBench bench;
  bench.activate();
  bench.input.soft_limit_exceeded = true;
  ASSERT_EQ(bench.tick(), Mode::vent);
  bench.input.soft_limit_exceeded = false;
  bench.input.fully_vented = true;
  EXPECT_EQ(bench.run(1000), Mode::vent);
  EXPECT_EQ(bench.monitor.reason(), Reason::waiting_for_arm);
  bench.input.requests.arm = true;
  EXPECT_EQ(bench.tick(), Mode::active);
}

TEST(SafetyMonitor, ArmingIsNotStoredUpForLater) {
  MonitorBench bench(Arming::explicit_);
  bench.input.fully_vented = true;
  bench.frames_per_tick = 0;
  bench.input.requests.arm = true;
  bench.tick();
  bench.frames_per_tick = 1;
  EXPECT_EQ(bench.run(200), Mode::wait_frames) << "armed when the arm could not be seen";
}

TEST(SafetyMonitor, AnArmingThatWaitsForFramesIsTakenBackByWhatWouldVent) {
  const std::function<void(MonitorBench&)> causes[] = {
      [](MonitorBench& bench) { bench.input.sender_restarted = true; },
      [](MonitorBench& bench) { bench.input.newest_capture_ns = bench.input.now_ns - 3000 * kMs; },
      [](MonitorBench& bench) { bench.input.deadman_used = true; }};
  for (const auto& cause : causes) {
    MonitorBench bench(Arming::explicit_);
    bench.input.fully_vented = true;
    bench.run(10);
    bench.input.requests.arm = true;
    bench.tick();
    ASSERT_TRUE(bench.monitor.armed());
    bench.frames_per_tick = 0;
    cause(bench);
    bench.tick();
    bench.input.deadman_used = false;
    bench.frames_per_tick = 1;
    EXPECT_EQ(bench.run(200), Mode::wait_frames);
    EXPECT_EQ(bench.monitor.reason(), Reason::waiting_for_arm);
  }
}

TEST(SafetyMonitor, AnArmThatQueuedUpDuringAStopDoesNotCount) {
  for (const Arming arming : {Arming::explicit_, Arming::automatic}) {
    MonitorBench bench(arming);
    bench.input.fully_vented = true;
    bench.run(100);
    bench.input.requests.disarm = true;
    bench.tick();
    bench.tick(4000 * kMs);
    for (int k = 0; k < 200; ++k) {  // 0.4 s of what is left in a socket
      bench.input.requests.arm = true;
      bench.tick();
    }
    EXPECT_FALSE(bench.monitor.armed());
    bench.run(100);
    bench.input.requests.arm = true;
    EXPECT_EQ(bench.tick(), Mode::active);
  }
}

TEST(SafetyMonitor, HoldEndsAfterFiftyGoodFrames) {
  MonitorBench bench;
  bench.activate();
  bench.frames_per_tick = 0;
  ASSERT_EQ(bench.run(9), Mode::hold);
  bench.frames_per_tick = 1;
  EXPECT_EQ(bench.run(49), Mode::hold);
  EXPECT_EQ(bench.run(1), Mode::active);
}

TEST(SafetyMonitor, VentTakesTheArmingBack) {
  MonitorBench bench(Arming::explicit_);
  bench.input.fully_vented = true;
  bench.run(60);
  bench.input.requests.arm = true;
  ASSERT_EQ(bench.tick(), Mode::active);
  bench.input.sender_restarted = true;
  EXPECT_EQ(bench.tick(), Mode::vent);
  bench.input.fully_vented = true;
  EXPECT_EQ(bench.run(500), Mode::vent);
  EXPECT_EQ(bench.monitor.reason(), Reason::waiting_for_arm);
  bench.input.requests.arm = true;
  EXPECT_EQ(bench.tick(), Mode::active);
}

TEST(SafetyMonitor, SilentValvesAreALatchedFault) {
  MonitorBench bench(Arming::automatic, true);
  bench.activate();
  for (int k = 0; k < 51; ++k) {
    bench.tick();
    bench.input.newest_measurement_ns = 0;
  }
  bench.input.now_ns += 2 * kMs;
  bench.input.newest_measurement_ns = bench.input.now_ns - 101 * kMs;
  EXPECT_EQ(bench.monitor.step(bench.input), Mode::fault);
  bench.input.fully_vented = true;
  EXPECT_EQ(bench.run(1000), Mode::fault) << "a fault is latched";
  bench.input.requests.disarm = true;
  EXPECT_EQ(bench.tick(), Mode::vent);
  EXPECT_EQ(bench.run(100), Mode::vent) << "disarmed";
  bench.input.requests.arm = true;
  EXPECT_EQ(bench.tick(), Mode::active);
}

/// Stops the daemon for 500 ms. LCM keeps the oldest messages: of the valves' it brings those of
/// the stop's first 32 ms.
Mode stop_and_go_on(MonitorBench& bench) {
  bench.input.newest_measurement_ns = bench.input.now_ns + 32 * kMs;
  bench.input.now_ns += 500 * kMs;
  bench.input.good_frames = 0;
  return bench.monitor.step(bench.input);
}

TEST(SafetyMonitor, WhatTheDaemonCouldNotHearIsNoSilence) {
  MonitorBench bench(Arming::automatic, true);
  bench.activate();
  EXPECT_EQ(stop_and_go_on(bench), Mode::vent);
  EXPECT_EQ(bench.monitor.reason(), Reason::time_gap);
  bench.input.fully_vented = true;
  EXPECT_EQ(bench.run(249), Mode::vent) << "for half a second nothing counts";
  EXPECT_EQ(bench.run(49), Mode::vent);
  EXPECT_EQ(bench.run(1), Mode::active);
}

TEST(SafetyMonitor, ValvesThatFellSilentDuringAStopAreNotedAfterIt) {
  MonitorBench bench(Arming::automatic, true);
  bench.activate();
  EXPECT_EQ(stop_and_go_on(bench), Mode::vent);
  const std::int64_t heard_ns = bench.input.newest_measurement_ns;
  const std::int64_t goes_on_ns = bench.input.now_ns;
  const auto tick = [&] {
    bench.input.now_ns += 2 * kMs;
    bench.input.good_frames = 10;
    bench.input.newest_capture_ns = bench.input.now_ns;
    bench.input.newest_measurement_ns = heard_ns;
    return bench.monitor.step(bench.input);
  };
  bench.input.fully_vented = true;
  while (bench.input.now_ns < goes_on_ns + 100 * kMs)
    ASSERT_EQ(tick(), Mode::vent) << "not ACTIVE before the valves have been heard";
  EXPECT_EQ(tick(), Mode::vent);
  EXPECT_EQ(bench.monitor.reason(), Reason::valves_silent);
  bench.input.fully_vented = false;
  EXPECT_EQ(tick(), Mode::fault) << "where there is pressure";

  // One stop after the other does not hide them either.
  MonitorBench again(Arming::automatic, true);
  again.activate();
  EXPECT_EQ(stop_and_go_on(again), Mode::vent);
  again.input.now_ns += 500 * kMs;
  EXPECT_EQ(again.monitor.step(again.input), Mode::fault);
  EXPECT_EQ(again.monitor.reason(), Reason::valves_silent);
}

TEST(SafetyMonitor, TheMoreSevereCauseWins) {
  MonitorBench bench;
  bench.activate();
  bench.input.poses_frozen = true;
  bench.input.requests.shutdown = true;
  EXPECT_EQ(bench.tick(), Mode::vent);
  EXPECT_EQ(bench.monitor.reason(), Reason::shutdown);
}

TEST(SafetyMonitor, NamesWhateverTheWireMayBring) {
  EXPECT_STREQ(name(Mode::fault), "FAULT");
  EXPECT_STREQ(name(Reason::valves_silent), "valves_silent");
  for (const int value : {-128, -1, kReasons, 100, 127}) {
    EXPECT_STREQ(name(static_cast<Mode>(value)), "unknown");
    EXPECT_STREQ(name(static_cast<Reason>(value)), "unknown");
  }
}

TEST(SafetyMonitor, RandomSequencesNeverBreakTheInvariants) {
  std::mt19937 random(7);
  const auto chance = [&random](double p) { return std::bernoulli_distribution(p)(random); };
  for (int sequence = 0; sequence < 200; ++sequence) {
    MonitorBench bench(chance(0.5) ? Arming::automatic : Arming::explicit_);
    Mode before = Mode::init;
    for (int k = 0; k < 1000; ++k) {
      if (chance(0.01)) bench.frames_per_tick = 1 - bench.frames_per_tick;
      if (chance(0.01)) bench.input.fully_vented = !bench.input.fully_vented;
      bench.input.poses_frozen = chance(0.005);
      bench.input.sender_restarted = chance(0.002);
      bench.input.requests.arm = chance(0.02);
      bench.input.requests.disarm = chance(0.002);
      const bool disarm = bench.input.requests.disarm;
      const bool restarted = bench.input.sender_restarted;
      const Mode mode = bench.tick(chance(0.002) ? 200 * kMs : 2 * kMs);
      const bool seen = bench.input.newest_capture_ns != kNever;
      const std::int64_t age =
          seen ? bench.input.now_ns - bench.input.newest_capture_ns : INT64_MAX;
      if (mode == Mode::active) {
        EXPECT_LE(age, 20 * kMs) << "active without fresh frames";
        EXPECT_TRUE(bench.monitor.armed());
        EXPECT_FALSE(disarm || restarted);
      }
      if (mode == Mode::active && before >= Mode::vent) {
        EXPECT_TRUE(bench.input.fully_vented);
      }
      if (before == Mode::active || before == Mode::hold) {
        if (age > 100 * kMs) {
          EXPECT_GE(mode, Mode::vent);
        }
      }
      before = mode;
    }
  }
}

}  // namespace
}  // namespace softarm
