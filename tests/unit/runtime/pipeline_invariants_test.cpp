// Random sequences of everything that can go wrong, through the whole pipeline: what must never
// happen does not.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "softarm/base/time.hpp"
#include "softarm/runtime/settings.hpp"
#include "unit/runtime/pipeline_bench.hpp"
#include "unit/runtime/random_faults.hpp"

namespace softarm {
namespace {

using test::kMs;
using test::PipelineBench;
using test::PressureLimits;
using test::RandomFaults;
using test::RandomLaw;

/// What the daemon promises, judged from what it was given and what it gave, by a reckoning of its
/// own.
class Promises {
 public:
  Promises(const PipelineBench& bench, const Experiment& experiment)
      : bench_(bench),
        limits_(experiment),
        thresholds_(resolve_thresholds(experiment.safety, 1.0 / experiment.rate_hz)) {
    newest_.fill(kNever);
  }

  /// Empty, or what was broken. To be called after each tick, with the operator's requests of it.
  std::string broken(const TickOutput& output, bool disarm, bool emergency_stop) {
    for (const MocapFrame& frame : bench_.delivered())
      for (std::size_t i = 0; i < newest_.size(); ++i)
        if (frame.body[i].valid && frame.body[i + 1].valid)
          newest_[i] = std::max(newest_[i], frame.capture_ns);
    const std::int64_t oldest = *std::min_element(newest_.begin(), newest_.end());
    // Bad numbers may stand in a frame; the age is a lower bound of what the daemon may go by.
    const bool fresh = oldest != kNever && bench_.now_ns - oldest <= thresholds_.hold_after_ns;
    const bool stale = oldest == kNever || bench_.now_ns - oldest > thresholds_.vent_after_ns;
    const Mode mode = output.mode;

    const bool expired = bench_.input.command_expired;
    std::string wrong = limits_.violation(output, expired);
    if (mode == Mode::active && expired) wrong = "ACTIVE although the valves have vented";
    if (mode == Mode::active && !fresh) wrong = "ACTIVE without fresh frames of every segment";
    if (mode == Mode::active && !output.motion.all_valid())
      wrong = "ACTIVE with an unknown segment";
    if (mode == Mode::active && !output.armed) wrong = "ACTIVE without being armed";
    if (mode == Mode::active && (disarm || emergency_stop))
      wrong = "ACTIVE against a person's will";
    if ((before_ == Mode::active || before_ == Mode::hold) && stale && mode < Mode::vent)
      wrong = "not vented without frames";
    if (before_ == Mode::fault && mode != Mode::fault && !disarm)
      wrong = "FAULT left without an operator";
    if (emergency_stop && (mode != Mode::fault || output.reason != Reason::emergency_stop))
      wrong = "an emergency stop without a FAULT";
    if (before_ >= Mode::vent && mode == Mode::active && !vented_before_)
      wrong = "ACTIVE before it was vented";
    if (before_ >= Mode::vent && mode == Mode::hold) wrong = "HOLD after VENT";
    if (mode >= Mode::vent) {
      ++venting_;
      if (venting_ > vent_ticks_ && !output.pressure_bar.isZero(0.0)) wrong = "VENT took too long";
    } else {
      venting_ = 0;
    }
    vented_before_ = output.pressure_bar.isZero(0.0);
    before_ = mode;
    return wrong;
  }
  void vent_within(double ticks) { vent_ticks_ = static_cast<int>(ticks) + 2; }

 private:
  const PipelineBench& bench_;
  PressureLimits limits_;
  SafetyThresholds thresholds_;
  std::array<std::int64_t, 3> newest_{};
  Mode before_ = Mode::init;
  bool vented_before_ = true;
  int venting_ = 0, vent_ticks_ = 0;
};

TEST(PipelineInvariants, HoldInEveryTickOfRandomSequences) {
  Experiment experiment = test::paper_arm();
  experiment.safety.valve_readback = true;
  experiment.safety.deadman = true;
  const double vent_ticks = experiment.actuation.max_pressure_bar /
                            experiment.actuation.vent_bar_per_s * experiment.rate_hz;
  std::set<Mode> modes;
  std::set<Reason> reasons;
  for (unsigned seed = 1; seed <= 52; ++seed) {
    const bool external = seed > 40;
    experiment.control.law = external ? LawKind(ExternalLaw{}) : LawKind();
    experiment.safety.arming = seed % 2 == 0 ? Arming::automatic : Arming::explicit_;
    PipelineBench bench(experiment);
    RandomFaults faults(bench, seed);
    RandomLaw law(bench, seed);
    Promises promises(bench, experiment);
    promises.vent_within(vent_ticks);
    bench.corrupt = [&](MocapFrame& frame) { return faults.corrupt(frame); };
    bench.leak = [&](PressureVector& measured_bar) { faults.leak(measured_bar); };
    const auto tick = [&] {
      faults.before_tick();
      faults.others_before_tick();
      if (external) law.before_tick();
      const bool disarm = bench.input.requests.disarm,
                 emergency_stop = bench.input.requests.emergency_stop;
      const TickOutput& output = bench.tick();
      modes.insert(output.mode);
      reasons.insert(output.reason);
      const std::int64_t until_ns = external ? law.until_ns() : kForever;
      if (output.mode == Mode::active && bench.now_ns > until_ns)
        return std::string("ACTIVE without a valid answer of its law");
      return promises.broken(output, disarm, emergency_stop);
    };
    for (unsigned k = 0; k < 3000 + 71 * seed; ++k)
      ASSERT_EQ(tick(), "") << "seed " << seed << ", tick " << k;
    bench.input.requests.shutdown = true;
    for (int k = 0; k < vent_ticks + 2; ++k)
      ASSERT_EQ(tick(), "") << "seed " << seed << ", shutting down, tick " << k;
    for (int k = 0; k < 100; ++k) {
      ASSERT_EQ(tick(), "") << "seed " << seed << ", shut down";
      ASSERT_TRUE(bench.pipeline.fully_vented());
      const TickOutput& output = bench.pipeline.output();
      ASSERT_TRUE(output.reason == Reason::shutdown || output.mode == Mode::fault);
    }
  }
  EXPECT_EQ(modes,
            (std::set{Mode::wait_frames, Mode::active, Mode::hold, Mode::vent, Mode::fault}));
  for (const CauseRule& rule : cause_table()) {
    // An ideal arm is always where it should be.
    if (rule.reason == Reason::soft_limit || rule.reason == Reason::curvature_mismatch ||
        rule.reason == Reason::oscillation || rule.reason == Reason::length_mismatch) {
      continue;
    }
    // Only a model-based observer knows.
    if (rule.reason == Reason::wrong_model || rule.reason == Reason::contact ||
        rule.reason == Reason::contact_vented)
      continue;
    // It is armed by hand again and again, and seen at the declared rate.
    if (rule.reason == Reason::activated_too_often || rule.reason == Reason::frame_period_mismatch)
      continue;
    EXPECT_EQ(reasons.count(rule.reason), 1u) << name(rule.reason) << " never came up";
  }
}

class Watches : public ::testing::Test {
 protected:
  Watches() { experiment.safety.valve_readback = true; }
  static void bend(PipelineBench& bench) {
    ASSERT_GT(bench.run_to(Mode::active), 0);
    bench.run(1000);
    ASSERT_EQ(bench.pipeline.output().mode, Mode::active);
  }
  Experiment experiment = test::paper_arm();
};

TEST_F(Watches, ValvesThatFollowAreAccepted) {
  PipelineBench bench(experiment);
  bend(bench);
  for (int k = 0; k < 2000; ++k) ASSERT_EQ(bench.tick().mode, Mode::active) << k;
}

TEST_F(Watches, ABurstIsAFaultWithinTwoSettlingTimes) {
  PipelineBench bench(experiment);
  bend(bench);
  Eigen::Index burst = 0;
  ASSERT_GT(bench.pipeline.output().pressure_bar.maxCoeff(&burst), 0.4);
  bench.leak = [&](PressureVector& measured_bar) { measured_bar[burst] = 0.0; };
  const int ticks = bench.run_to(Mode::fault, 1000);
  EXPECT_GT(ticks, 0);
  EXPECT_LE(ticks, 2 * 150 + PressureWatch::kInRow);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::pressure_mismatch);
  bench.leak = nullptr;
  bench.run(500);
  EXPECT_EQ(bench.pipeline.output().mode, Mode::fault);
}

// Its last value was right and stays near: only that it repeats gives it away.
TEST_F(Watches, AReadBackThatRepeatsWhileItsCommandMovesIsAFault) {
  experiment.safety.pressure_tolerance_bar = 0.25;
  for (const Eigen::Index valve : {0, 1, 3}) {  // nothing is ever asked of chamber 2
    PipelineBench bench(experiment);
    bend(bench);
    double last_bar = -1.0;
    bench.leak = [&](PressureVector& measured_bar) {
      if (last_bar < 0.0) last_bar = measured_bar[valve];
      measured_bar[valve] = last_bar;
    };
    EXPECT_GT(bench.run_to(Mode::fault, 3000), 0) << valve;
    EXPECT_EQ(bench.pipeline.output().reason, Reason::pressure_mismatch);
  }
}

// Somebody has opened the supply since; vented valves go on to measure the same zero.
TEST_F(Watches, ValvesThatRepeatZeroAtRestAreNoReasonAnyMore) {
  PipelineBench bench(experiment);
  bench.leak = [](PressureVector& measured_bar) { measured_bar.setZero(); };
  ASSERT_GT(bench.run_to(Mode::fault, 3000), 0);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::pressure_mismatch);
  bench.run(1000);
  bench.input.requests.disarm = true;
  bench.tick();
  bench.input.requests = {};
  bench.run(10);
  EXPECT_NE(bench.pipeline.output().reason, Reason::pressure_mismatch);
}

// Valves at rest, and coarse ones, repeat what they measure.
TEST_F(Watches, ACoarseReadBackIsNotStale) {
  PipelineBench bench(experiment);
  bend(bench);
  bench.leak = [](PressureVector& measured_bar) {
    for (double& each : measured_bar) each = 0.05 * std::round(each / 0.05);
  };
  EXPECT_EQ(bench.run_to(Mode::fault, 5000), -1) << name(bench.pipeline.output().reason);
}

TEST_F(Watches, AValveThatDoesNotVentIsAFault) {
  PipelineBench bench(experiment);
  bend(bench);
  bench.leak = [](PressureVector& measured_bar) { measured_bar[2] = 1.0; };
  EXPECT_GT(bench.run_to(Mode::fault, 1000), 0);
}

TEST_F(Watches, ASingleWildMeasurementIsNoBurst) {
  PipelineBench bench(experiment);
  bend(bench);
  int k = 0;
  bench.leak = [&](PressureVector& measured_bar) {
    if (++k % 10 < 2) measured_bar[3] = std::nan("");
  };
  EXPECT_EQ(bench.run_to(Mode::fault, 1000), -1);
}

// The valves have vented by themselves meanwhile: what they measure then is no burst.
TEST_F(Watches, AfterAGapInTimeNothingIsJudgedTooEarly) {
  PipelineBench bench(experiment);
  bend(bench);
  bench.now_ns += 300 * kMs;
  bool vented = false;
  bench.leak = [&](PressureVector& measured_bar) {
    if (!vented) measured_bar.setZero();
  };
  bench.tick();
  EXPECT_EQ(bench.pipeline.output().reason, Reason::time_gap);
  bench.run(150);
  vented = true;
  EXPECT_EQ(bench.run_to(Mode::fault, 600), -1) << name(bench.pipeline.output().reason);
}

TEST_F(Watches, PressureThatStaysKeepsTheArmFromBecomingActive) {
  experiment.safety.pressure_settling_s = 0.2;  // less than fifty frames take
  PipelineBench bench(experiment);
  bench.leak = [](PressureVector& measured_bar) { measured_bar[0] += 0.5; };
  bench.run(1000);
  EXPECT_NE(bench.pipeline.output().mode, Mode::fault);
  EXPECT_NE(bench.pipeline.output().mode, Mode::active);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::pressure_mismatch);
}

TEST_F(Watches, AnArmThatDoesNotBalanceIsAFaultOnlyWhereThatIsAskedFor) {
  for (const double limit_nm : {0.0, 0.15}) {
    experiment.safety.curvature_residual_nm = limit_nm;
    PipelineBench bench(experiment);
    bend(bench);
    for (int k = 0; k < 1000; ++k) ASSERT_EQ(bench.tick().mode, Mode::active) << "it balances";
    // A chamber of the middle segment bursts without measured pressures: the segment goes straight.
    bench.moves = false;
    const int ticks = [&] {
      for (int k = 1; k <= 1000; ++k) {
        bench.u.segment<2>(2) *= 0.97;
        if (bench.tick().mode == Mode::fault) return k;
      }
      return -1;
    }();
    if (limit_nm == 0.0) {
      EXPECT_EQ(ticks, -1);
    } else {
      EXPECT_GT(ticks, 250) << "the settling time is half a second";
      EXPECT_EQ(bench.pipeline.output().reason, Reason::curvature_mismatch);
    }
  }
}

/// All positions away from the base by `factor`: every segment is longer by it.
void lengthen(MocapFrame& frame, double factor) {
  for (int i = 1; i <= frame.segments; ++i) {
    Eigen::Vector3d& position = frame.body[static_cast<std::size_t>(i)].position_m;
    position = frame.body[0].position_m + factor * (position - frame.body[0].position_m);
  }
}

TEST_F(Watches, ALengthThatIsNotConfiguredIsReportedThenAFault) {
  for (const double factor : {0.85, 0.93, 0.97, 1.0, 1.03, 1.07, 1.15, 1.28}) {
    SCOPED_TRACE(factor);
    PipelineBench bench(experiment);
    bend(bench);
    bench.corrupt = [&](MocapFrame& frame) {
      lengthen(frame, factor);
      return true;
    };
    bench.run(240);
    EXPECT_EQ(bench.pipeline.output().mode, Mode::active) << "the settling time is half a second";
    EXPECT_FALSE(bench.pipeline.output().length_warning);
    bench.run(30);
    const double off = std::abs(factor - 1.0);
    EXPECT_EQ(bench.pipeline.output().length_warning, off > 0.05);
    EXPECT_EQ(bench.pipeline.output().mode, off > 0.1 ? Mode::fault : Mode::active);
    if (off > 0.1) {
      EXPECT_EQ(bench.pipeline.output().reason, Reason::length_mismatch);
    }
    bench.corrupt = nullptr;
    bench.run(500);
    EXPECT_FALSE(bench.pipeline.output().length_warning);
    EXPECT_EQ(bench.pipeline.output().mode, off > 0.1 ? Mode::fault : Mode::active);
  }
}

TEST_F(Watches, AnArmOfAnotherLengthDoesNotBecomeActive) {
  PipelineBench bench(experiment);
  double factor = 1.15;
  bench.corrupt = [&](MocapFrame& frame) {
    lengthen(frame, factor);
    return true;
  };
  for (int k = 0; k < 1000; ++k) ASSERT_NE(bench.tick().mode, Mode::active);
  EXPECT_EQ(bench.pipeline.output().mode, Mode::wait_frames);
  EXPECT_EQ(bench.pipeline.output().reason, Reason::length_mismatch);
  factor = 1.0;  // the marker frame is put right
  EXPECT_GT(bench.run_to(Mode::active), 0);

  experiment.safety.length_fault = 0.0;
  PipelineBench unchecked(experiment);
  factor = 1.15;
  unchecked.corrupt = bench.corrupt;
  EXPECT_GT(unchecked.run_to(Mode::active), 0);
  unchecked.run(1000);
  EXPECT_EQ(unchecked.pipeline.output().mode, Mode::active);
  EXPECT_TRUE(unchecked.pipeline.output().length_warning);
}

TEST_F(Watches, SoftLimitsOnAngleAndSpeedVentAndWaitForAnArm) {
  const auto lean = [](PipelineBench& bench) {  // slowly, beyond max_theta_rad
    for (int k = 0; k < 300 && bench.pipeline.output().mode == Mode::active; ++k) {
      bench.u[0] += 0.02;
      bench.tick();
    }
  };
  const auto whip = [](PipelineBench& bench) {  // less far, at 30 rad/s
    for (int k = 0; k < 30 && bench.pipeline.output().mode == Mode::active; ++k) {
      bench.u[4] += 0.06;
      bench.tick();
    }
  };
  for (const std::function<void(PipelineBench&)>& move :
       {std::function<void(PipelineBench&)>(lean), std::function<void(PipelineBench&)>(whip)}) {
    PipelineBench bench(experiment);
    bend(bench);
    bench.moves = false;
    move(bench);
    ASSERT_EQ(bench.pipeline.output().mode, Mode::vent);
    EXPECT_EQ(bench.pipeline.output().reason, Reason::soft_limit);
    EXPECT_TRUE(bench.pipeline.output().soft_limit);
    bench.moves = true;
    bench.run(1500);
    EXPECT_EQ(bench.pipeline.output().reason, Reason::waiting_for_arm);
    bench.input.requests.arm = true;
    EXPECT_EQ(bench.tick().mode, Mode::active);
  }
}

}  // namespace
}  // namespace softarm
