// The tick as a whole: which frames it uses, what it does without them, how it takes a live
// reference.
#include "softarm/runtime/control_pipeline.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <optional>
#include <random>
#include <vector>

#include "softarm/estimation/model_observer.hpp"
#include "softarm/runtime/settings.hpp"
#include "unit/runtime/pipeline_bench.hpp"

namespace softarm {
namespace {

using test::kMs;
using test::PipelineBench;

class Pipeline : public ::testing::Test {
 protected:
  /// ACTIVE, bent and with pressure in its chambers.
  static void bend(PipelineBench& bench) {
    ASSERT_GT(bench.run_to(Mode::active), 0);
    bench.run(1000);
    ASSERT_EQ(bench.pipeline.output().mode, Mode::active);
    ASSERT_GT(bench.pipeline.output().pressure_bar.maxCoeff(), 0.05);
  }

  const Experiment experiment = test::paper_arm();
};

TEST_F(Pipeline, FollowsTheReferenceOnceFiftyFramesAreGood) {
  PipelineBench bench(experiment);
  const int ticks = bench.run_to(Mode::active);
  // Fifty frames at 200 Hz take 245 ms, and 5 ms more to arrive.
  EXPECT_NEAR(ticks, 126, 3);
  bench.run(1000);
  const TickOutput& output = bench.pipeline.output();
  EXPECT_EQ(output.mode, Mode::active);
  EXPECT_LT((output.motion.u_rad - output.reference.u).norm(), 0.02);
  EXPECT_NEAR(output.frame_age_s, 0.0065, 0.0045);
  EXPECT_EQ(bench.pipeline.counters().rejected(), 0);
  EXPECT_EQ(bench.pipeline.late_frames(), 0);
}

TEST_F(Pipeline, FrozenPosesHoldWhileTheCommandMoves) {
  PipelineBench bench(experiment);
  bend(bench);
  MocapFrame frozen = bench.exact_frame();
  bench.corrupt = [&](MocapFrame& frame) {
    frame.body = frozen.body;
    return true;
  };
  // A hundred identical poses take 500 ms.
  const int ticks = bench.run_to(Mode::hold, 400);
  EXPECT_GT(ticks, 240);
  EXPECT_LT(ticks, 270);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::poses_frozen);
  const PressureVector held = bench.pipeline.output().pressure_bar;
  bench.run(500);
  EXPECT_EQ(bench.pipeline.output().mode, Mode::hold) << "frozen frames are not good frames";
  EXPECT_EQ(bench.pipeline.output().pressure_bar, held);
}

// The declared noise on every body, and then one repeats its last pose.
TEST_F(Pipeline, OneFrozenSegmentEndIsHeldThenVented) {
  for (const ObserverKind observer : {ObserverKind::kinematic, ObserverKind::model}) {
    for (std::size_t body = 1; body <= 3; ++body) {
      SCOPED_TRACE(body);
      Experiment noisy = experiment;
      noisy.estimation.observer = observer;
      PipelineBench bench(noisy);
      std::mt19937 random(3);
      std::optional<BodyPose> last;
      bool freeze = false;
      bench.corrupt = [&](MocapFrame& frame) {
        std::normal_distribution<double> noise(0.0, 0.2e-3);
        for (std::size_t b = 0; b <= 3; ++b)
          for (double& each : frame.body[b].position_m) each += noise(random);
        if (freeze && !last) last = frame.body[body];
        if (freeze) frame.body[body] = *last;
        return true;
      };
      bend(bench);
      bench.run(1000);
      ASSERT_EQ(bench.pipeline.output().mode, Mode::active);
      freeze = true;
      const int ticks = bench.run_to(Mode::hold, 200);
      EXPECT_GT(ticks, 0);
      EXPECT_LT(ticks, 75) << "150 ms";
      EXPECT_LT(bench.run_to(Mode::vent, 200), 60);
      freeze = false;
      EXPECT_GT(bench.run_to(Mode::active, 1000), 0) << "it was seen again";
    }
  }
}

TEST_F(Pipeline, ATurnedBodyIsRefusedBeforeArmingToo) {
  PipelineBench bench(experiment);
  bench.corrupt = [&](MocapFrame& frame) {
    frame.body[2].orientation =
        frame.body[2].orientation * Eigen::AngleAxisd(1.5708, Eigen::Vector3d::UnitZ());
    return true;
  };
  EXPECT_EQ(bench.run_to(Mode::active, 1000), -1);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::frames_refused);
  EXPECT_EQ(bench.pipeline.output().refusal, FrameVerdict::bad_torsion);
  EXPECT_GT(bench.pipeline.counters().bad_torsion, 100);
}

// Declared 8.3 times too long, and every threshold derived from it too.
TEST_F(Pipeline, FramesMuchFasterThanDeclaredKeepItVented) {
  Experiment slip = experiment;
  slip.safety.frame_period_s = 0.0415;
  PipelineBench bench(slip);
  bench.run(2000);
  EXPECT_NE(bench.pipeline.output().mode, Mode::active);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::frame_period_mismatch);
}

// The command of an arm at rest moves at once; its poses follow later, as sensors are late.
TEST_F(Pipeline, AnExactArmAtRestThatIsCommandedToMoveIsNotFrozen) {
  Experiment live = experiment;
  live.reference.phases = {{LiveReference{}, 0.0}};
  PipelineBench bench(live);
  bench.moves = false;
  const MocapFrame rest = bench.exact_frame();
  std::int64_t moves_ns = kForever;
  bench.corrupt = [&](MocapFrame& frame) {
    frame.body = rest.body;
    if (bench.now_ns >= moves_ns)
      frame.body[3].position_m.x() += 1e-7 * static_cast<double>(frame.frame_number);
    return true;
  };
  ASSERT_GT(bench.run_to(Mode::active), 0);
  bench.run(600);
  const LiveReferenceInput step{SegmentVector::Constant(6, 0.1), SegmentVector::Zero(6),
                                SegmentVector::Zero(6)};
  moves_ns = bench.now_ns + 10 * kMs;
  for (int k = 0; k < 100; ++k) {
    bench.input.reference = &step;
    ASSERT_EQ(bench.tick().mode, Mode::active) << k << name(bench.pipeline.output().reason);
  }
}

TEST_F(Pipeline, AnExactArmAtRestIsNotFrozen) {
  Experiment still = experiment;
  SetPointReference rest{.u_rad = std::vector<double>(6, 0.0)};
  still.reference.phases = {{rest, 0.0}};
  PipelineBench bench(still);
  MocapFrame first = bench.exact_frame();
  bench.corrupt = [&](MocapFrame& frame) {
    frame.body = first.body;
    return true;
  };
  ASSERT_GT(bench.run_to(Mode::active), 0);
  EXPECT_EQ(bench.run_to(Mode::hold, 1000), -1) << name(bench.pipeline.output().reason);
}

TEST_F(Pipeline, AnOccludedBodyIsPredictedThenHeldThenVented) {
  PipelineBench bench(experiment);
  bend(bench);
  bench.corrupt = [](MocapFrame& frame) {
    frame.body[2].valid = false;
    return true;
  };
  const std::int64_t since_ns = bench.next_capture_ns;  // of the first frame without it
  bool all_valid_while_active = true;
  while (bench.tick().mode == Mode::active && bench.now_ns < since_ns + 200 * kMs)
    all_valid_while_active &= bench.pipeline.output().motion.all_valid();
  EXPECT_TRUE(all_valid_while_active) << "control with a segment that is not known";
  EXPECT_EQ(bench.pipeline.output().mode, Mode::hold);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::frames_late);
  // 3 frame periods and the latency after the last capture that saw it.
  EXPECT_GT(bench.now_ns, since_ns + 14 * kMs);
  EXPECT_LE(bench.now_ns, since_ns + 20 * kMs);
  ASSERT_GT(bench.run_to(Mode::vent, 100), 0);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::frames_stale);
  EXPECT_NEAR(static_cast<double>(bench.now_ns - since_ns), 95e6, 5e6);
  EXPECT_EQ(bench.pipeline.counters().rejected(), 0);
}

// The same where frames come faster than declared: the count of predicted frames is used up long
// before the age is.
TEST_F(Pipeline, AnUnknownSegmentIsNeverControlled) {
  PipelineBench bench(experiment);
  bench.frame_period_ns = 2 * kMs;
  bend(bench);
  bench.corrupt = [](MocapFrame& frame) {
    frame.body[3].valid = false;
    return true;
  };
  for (int k = 0; k < 30; ++k) {
    const TickOutput& output = bench.tick();
    ASSERT_TRUE(output.mode != Mode::active || output.motion.all_valid()) << "tick " << k;
  }
  EXPECT_EQ(bench.pipeline.output().mode, Mode::hold);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::frames_late);
}

TEST_F(Pipeline, ABriefOcclusionIsSurvived) {
  PipelineBench bench(experiment);
  bend(bench);
  int left = 2;
  bench.corrupt = [&](MocapFrame& frame) {
    if (left-- > 0) frame.body[1].valid = false;
    return true;
  };
  for (int k = 0; k < 200; ++k) ASSERT_EQ(bench.tick().mode, Mode::active) << k;
}

TEST_F(Pipeline, SwappedBodiesAreRejected) {
  PipelineBench bench(experiment);
  bend(bench);
  const std::int64_t accepted = bench.pipeline.counters().accepted;
  const std::pair<std::size_t, std::size_t> swaps[] = {{1, 2}, {2, 3}, {1, 3}, {0, 1}, {0, 3}};
  int sent = 0;
  bench.corrupt = [&](MocapFrame& frame) {
    const auto [a, b] = swaps[static_cast<std::size_t>(sent++ % 5)];
    std::swap(frame.body[a], frame.body[b]);
    return true;
  };
  bench.run(100);
  // One good frame was still under way.
  EXPECT_LE(bench.pipeline.counters().accepted, accepted + 1);
  EXPECT_GE(bench.pipeline.counters().bad_length + bench.pipeline.counters().jump, sent - 1);
  EXPECT_EQ(bench.run_to(Mode::vent, 100) > 0, true);
}

TEST_F(Pipeline, LateFramesAreDroppedAndCounted) {
  PipelineBench bench(experiment);
  bend(bench);
  const std::int64_t accepted = bench.pipeline.counters().accepted;
  bench.latency_ns = 60 * kMs;  // max_latency_s is 50 ms
  bench.run(500);
  EXPECT_LE(bench.pipeline.counters().accepted, accepted + 1);
  EXPECT_NEAR(static_cast<double>(bench.pipeline.late_frames()), 188.0, 2.0);
  EXPECT_EQ(bench.pipeline.output().mode, Mode::vent);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::frames_stale);
}

TEST_F(Pipeline, ACaptureInTheFutureIsNotUsed) {
  PipelineBench bench(experiment);
  bend(bench);
  bench.corrupt = [&](MocapFrame& frame) {
    bench.send(frame, bench.latency_ns);
    frame.frame_number = bench.next_number++;
    frame.capture_ns += 3600 * std::int64_t{1000} * kMs;
    bench.send(frame, bench.latency_ns - 3600 * std::int64_t{1000} * kMs);
    return false;
  };
  bench.run(20);
  bench.corrupt = nullptr;
  bench.publishing = false;
  EXPECT_GT(bench.run_to(Mode::vent, 100), 0) << "a sender's wrong clock must not hide its silence";
}

TEST_F(Pipeline, ARestartedSenderVents) {
  for (const std::int64_t back : {100, 6}) {
    PipelineBench bench(experiment);
    bend(bench);
    bench.next_number -= back;
    ASSERT_GT(bench.run_to(Mode::vent, 50), 0) << back;
    EXPECT_EQ(bench.pipeline.output().reason, Reason::sender_restarted);
    EXPECT_EQ(bench.pipeline.counters().restarted, 1);
  }
}

TEST_F(Pipeline, AGapInTimeVentsAndForgetsWhatWasQueued) {
  PipelineBench bench(experiment);
  bend(bench);
  const std::int64_t accepted = bench.pipeline.counters().accepted;
  bench.now_ns += 150 * kMs;
  bench.next_capture_ns = bench.now_ns + 100 * kMs;
  bench.tick();
  EXPECT_EQ(bench.pipeline.output().mode, Mode::vent);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::time_gap);
  EXPECT_EQ(bench.pipeline.counters().accepted, accepted);
}

// The machine was suspended: no time has passed on its clock, but for everything else it has.
TEST_F(Pipeline, APauseOfTheClockVentsForgetsTheCommandAndWhatWasQueued) {
  Experiment explicitly = experiment;
  explicitly.safety.arming = Arming::explicit_;
  PipelineBench bench(explicitly);
  bench.run(200);
  bench.input.requests.arm = true;
  ASSERT_GT(bench.run_to(Mode::active), 0);
  bench.run(500);
  ASSERT_GT(bench.pipeline.output().pressure_bar.maxCoeff(), 0.1);
  const std::int64_t accepted = bench.pipeline.counters().accepted;
  bench.input.paused = true;
  bench.tick();
  bench.input.paused = false;
  EXPECT_EQ(bench.pipeline.output().mode, Mode::vent);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::time_gap);
  EXPECT_TRUE(bench.pipeline.output().pressure_bar.isZero());
  EXPECT_EQ(bench.pipeline.counters().accepted, accepted);
  EXPECT_EQ(bench.run_to(Mode::active), -1);
  EXPECT_FALSE(bench.pipeline.output().armed);
}

// The valves vent while we are held up: what was commanded before is nothing to go on from.
TEST_F(Pipeline, AfterAStallPressuresRiseFromZeroWithinTheSlew) {
  Experiment slow = experiment;
  slow.actuation.slew_bar_per_s = 2.0;
  slow.safety.vent_after_s = 0.5;
  const double step_bar = 2.0 / slow.rate_hz * (1.0 + 1e-12);
  for (const std::int64_t stall_ms : {110, 300, 1000}) {
    PipelineBench bench(slow);
    bend(bench);
    bench.now_ns += stall_ms * kMs;
    bench.next_capture_ns = bench.now_ns;
    for (int k = 1; k <= 20; ++k)
      ASSERT_LE(bench.tick().pressure_bar.maxCoeff(), k * step_bar) << stall_ms << " ms, " << k;
  }
}

// The valves have vented, although the stall was shorter than the gap that vents: the operator has
// to see that before the arm is armed again.
TEST_F(Pipeline, AfterAStallThatOutlivedACommandTheArmIsVentedAndDisarmed) {
  Experiment explicitly = experiment;
  explicitly.safety.arming = Arming::explicit_;
  explicitly.safety.vent_after_s = 0.5;
  PipelineBench bench(explicitly);
  bench.run(200);
  bench.input.requests.arm = true;
  ASSERT_GT(bench.run_to(Mode::active), 0);
  bench.now_ns += 140 * kMs;
  bench.next_capture_ns = bench.now_ns;
  bench.tick();
  EXPECT_EQ(bench.pipeline.output().mode, Mode::vent);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::command_expired);
  EXPECT_EQ(bench.run_to(Mode::active), -1);
  EXPECT_FALSE(bench.pipeline.output().armed);
}

TEST_F(Pipeline, FramesThatQueuedUpInAStopDoNotMakeItActive) {
  PipelineBench bench(experiment);
  bend(bench);
  bench.now_ns += 600 * kMs;
  bench.next_capture_ns = bench.now_ns;
  bench.tick();
  ASSERT_EQ(bench.pipeline.output().reason, Reason::time_gap);
  bench.frame_period_ns = bench.latency_ns =
      100'000;  // as they leave the kernel, with new time stamps
  EXPECT_EQ(bench.run_to(Mode::active, 240), -1);
  EXPECT_GT(bench.run_to(Mode::active), 0);
}

TEST_F(Pipeline, ASoftLimitCountsInHoldWhileTheArmIsSeen) {
  PipelineBench bench(experiment);
  bend(bench);
  bench.corrupt = [](MocapFrame& frame) {  // one frame in 20 is bad: HOLD does not end
    if (frame.frame_number % 20 == 0) frame.body[1].valid = false;
    return true;
  };
  bench.publishing = false;
  ASSERT_GT(bench.run_to(Mode::hold, 50), 0);
  bench.publishing = true;
  bench.moves = false;
  for (int k = 0; k < 1000 && bench.pipeline.output().mode == Mode::hold; ++k) {
    bench.u *= 1.003;
    bench.tick();
  }
  EXPECT_EQ(bench.pipeline.output().mode, Mode::vent);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::soft_limit);
}

TEST_F(Pipeline, AfterVentTheReferenceIsJoinedFromWhereTheArmIs) {
  PipelineBench bench(experiment);
  bend(bench);
  bench.publishing = false;
  ASSERT_GT(bench.run_to(Mode::vent), 0);
  bench.publishing = true;
  ASSERT_GT(bench.run_to(Mode::active), 0);
  EXPECT_LT((bench.pipeline.output().reference.u - bench.u).norm(), 0.02);
}

TEST_F(Pipeline, WithTheModelObserverMotionIsItsOwn) {
  Experiment modelled = experiment;
  modelled.estimation.observer = ObserverKind::model;
  PipelineBench observed(modelled);
  ASSERT_GT(observed.run_to(Mode::active), 0);
  observed.run(500);
  const TickOutput& output = observed.pipeline.output();
  ASSERT_NE(output.observer, nullptr);
  EXPECT_TRUE(output.motion.all_valid());
  // The ideal arm of this bench obeys no law of motion, so the observer finds a disturbance; it
  // follows all the same.
  EXPECT_LT((output.motion.u_rad - observed.u).norm(), 0.02);
  EXPECT_TRUE(output.observer->correction().disturbance_nm.allFinite());
}

TEST_F(Pipeline, WhereTheModelCannotBeFactoredTheKinematicFilterServes) {
  Experiment impossible = experiment;
  impossible.estimation.observer = ObserverKind::model;
  impossible.arm.segments[1].stiffness_nm_per_rad = -1e6;  // no arm: B + ... + g^2 h^2 K indefinite
  PipelineBench broken(impossible);
  ASSERT_GT(broken.run_to(Mode::active), 0);
  int fell_back = 0;
  for (int k = 0; k < 200; ++k) {
    const TickOutput& output = broken.tick();
    ASSERT_EQ(output.mode, Mode::active);
    EXPECT_TRUE(output.motion.all_valid());
    fell_back += output.observer == nullptr ? 1 : 0;
  }
  EXPECT_GT(fell_back, 50);
}

class LiveReferenceInPipeline : public Pipeline {
 protected:
  LiveReferenceInPipeline() {
    settings.reference.phases = {{LiveReference{.timeout_s = 0.2}, 0.0}};
    message.u = message.velocity = message.acceleration = SegmentVector::Zero(6);
  }
  Experiment settings = test::paper_arm();
  LiveReferenceInput message;
};

TEST_F(LiveReferenceInPipeline, IsJoinedSmoothly) {
  PipelineBench bench(settings);
  ASSERT_GT(bench.run_to(Mode::active), 0);
  bench.run(10);
  SegmentVector before = bench.pipeline.output().reference.u;
  message.u.setConstant(0.1);
  double largest_step = 0.0;
  for (int k = 0; k < 1000; ++k) {
    if (k % 10 == 0) bench.input.reference = &message;
    const TickOutput& output = bench.tick();
    ASSERT_EQ(output.mode, Mode::active);
    ASSERT_FALSE(output.reference_limited) << k;
    largest_step = std::max(largest_step, (output.reference.u - before).cwiseAbs().maxCoeff());
    before = output.reference.u;
  }
  // A quintic over blend_s is fastest at 15/8 of its mean speed; every message begins a new one.
  EXPECT_LT(largest_step, 1.25 * 1.875 * 0.1 * 0.002 / settings.control.blend_s);
  EXPECT_LT((before - message.u).norm(), 1e-3);
}

TEST_F(LiveReferenceInPipeline, TooLargeAStepAndNaNAreRefusedAndFlagged) {
  PipelineBench bench(settings);
  ASSERT_GT(bench.run_to(Mode::active), 0);
  bench.run(100);
  const SegmentVector before = bench.pipeline.output().reference.u;
  message.u.setConstant(0.5);  // max_step_rad is 0.2
  bench.input.reference = &message;
  EXPECT_TRUE(bench.tick().reference_limited);
  EXPECT_FALSE(bench.tick().reference_limited) << "the flag belongs to the tick";
  message.u.setConstant(std::nan(""));
  bench.input.reference = &message;
  EXPECT_TRUE(bench.tick().reference_limited);
  bench.run(500);
  EXPECT_LT((bench.pipeline.output().reference.u - before).norm(), 1e-9);
}

TEST_F(LiveReferenceInPipeline, BeforeActiveAndInHoldItIsIgnored) {
  PipelineBench bench(settings);
  while (bench.pipeline.output().mode != Mode::active) {
    bench.input.reference = &message;
    ASSERT_FALSE(bench.tick().reference_limited) << "nothing was limited: there was no status yet";
  }
  bench.run(10);
  bench.publishing = false;
  ASSERT_GT(bench.run_to(Mode::hold), 0);
  message.u.setConstant(1.0);
  bench.input.reference = &message;
  EXPECT_FALSE(bench.tick().reference_limited);
}

// No instant of the clock is a special one: a capture at zero is not "never".
TEST_F(Pipeline, TheOriginOfTimeDoesNotMatter) {
  const auto run_from = [&](std::int64_t start_ns) {
    PipelineBench bench(experiment);
    bench.now_ns = bench.next_capture_ns = start_ns;
    bench.sent_ns = start_ns - 1000 * kMs;
    std::vector<std::uint64_t> said;
    const auto add = [&said](double value) { said.push_back(std::bit_cast<std::uint64_t>(value)); };
    for (int k = 0; k < 700; ++k) {
      bench.publishing = k < 400 || k > 500;  // HOLD, VENT and back
      const TickOutput& output = bench.tick();
      said.push_back(static_cast<std::uint64_t>(output.mode));
      said.push_back(static_cast<std::uint64_t>(output.reason));
      add(output.frame_age_s);
      for (const double each : output.pressure_bar) add(each);
      for (const double each : output.motion.u_rad) add(each);
    }
    return said;
  };
  const std::vector<std::uint64_t> expected = run_from(1000 * kMs);
  // Whole periods of ticks and frames: zero is one of the captures.
  for (const std::int64_t start_ns : {-10 * kMs, -500 * kMs, -820 * kMs, std::int64_t{0}})
    EXPECT_TRUE(run_from(start_ns) == expected) << start_ns;
}

}  // namespace
}  // namespace softarm
