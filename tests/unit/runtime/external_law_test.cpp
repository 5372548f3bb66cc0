// A control law outside of the pipeline: what its answers do, which are refused, and that silence
// holds, then vents.
#include <gtest/gtest.h>

#include <memory>

#include "counted_malloc.hpp"
#include "softarm/actuation/pressure_allocator.hpp"
#include "unit/runtime/pipeline_bench.hpp"

namespace softarm {
namespace {

using test::kMs;
using test::PipelineBench;

Experiment under_external_law() {
  Experiment experiment = test::paper_arm();
  experiment.control.law = ExternalLaw{};
  return experiment;
}

/// A law that answers every state within a tick until a test says otherwise.
class ExternalLawBench {
 public:
  explicit ExternalLawBench(const Experiment& experiment = under_external_law())
      : bench(std::make_unique<PipelineBench>(experiment)) {
    law.validity_ns = 50 * kMs;
    law.values = PressureVector::Zero(6);
  }
  const TickOutput& tick() {
    const bool asked = bench->pipeline.output().law != nullptr;
    law.state_ns = state_ns >= 0 ? state_ns : bench->now_ns;  // of the tick before
    law.arrival_ns = bench->now_ns + kMs;
    bench->input.law = answers && asked ? &law : nullptr;
    sent += answers && asked ? 1 : 0;
    return bench->tick();
  }
  const TickOutput& run(int ticks) {
    for (int k = 0; k < ticks; ++k) tick();
    return bench->pipeline.output();
  }
  std::int64_t count(LawVerdict verdict) const {
    return bench->pipeline.law_counts()[static_cast<std::size_t>(verdict)];
  }

  std::unique_ptr<PipelineBench> bench;
  LawInput law;
  bool answers = true;
  std::int64_t sent = 0;
  std::int64_t state_ns = -1;  ///< that it answers; -1: of the tick before
};

TEST(ExternalLaw, WithoutAnswersTheArmIsNeverActive) {
  ExternalLawBench it;
  it.answers = false;
  EXPECT_EQ(it.run(1000).mode, Mode::wait_frames);
  EXPECT_EQ(it.bench->pipeline.output().reason, Reason::law_silent);
  ASSERT_NE(it.bench->pipeline.output().law, nullptr) << "it is asked all the same";
}

TEST(ExternalLaw, BeforeActiveTheReferenceRestsWhereTheArmIs) {
  ExternalLawBench it;
  it.bench->u << 0.2, -0.1, 0.05, 0.3, 0.0, 0.1;
  it.bench->moves = it.answers = false;
  const LawView* law = it.run(200).law;
  ASSERT_NE(law, nullptr);
  EXPECT_LT((law->u_rad - it.bench->u).norm(), 1e-6);
  EXPECT_EQ(law->reference.u, law->u_rad);
  EXPECT_TRUE(law->reference.velocity.isZero(0.0));
  EXPECT_TRUE(law->reference.acceleration.isZero(0.0));
  EXPECT_EQ(law->active_s, 0.0);
}

// By another route: the force that the commanded pressures give, from the map of the chambers.
TEST(ExternalLaw, ItsForceReachesTheChambers) {
  const Experiment experiment = under_external_law();
  ExternalLawBench it(experiment);
  it.law.values << 0.3, -0.2, 0.1, 0.4, -0.25, 0.05;
  ASSERT_EQ(it.run(600).mode, Mode::active);
  const TickOutput& output = it.bench->pipeline.output();
  EXPECT_FALSE(output.saturated);
  SegmentVector force(6);
  PressureAllocator(experiment.actuation).generalized_force(output.pressure_bar, force);
  EXPECT_LT((force - it.law.values).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_NEAR(output.law_round_trip_s, 1e-3, 1e-12);
  EXPECT_EQ(it.count(LawVerdict::accepted), it.sent);
  EXPECT_GT(it.sent, 580);
}

TEST(ExternalLaw, ItsPressuresAreCommandedWithinTheSlew) {
  const Experiment experiment = under_external_law();
  ExternalLawBench it(experiment);
  it.law.answer = LawAnswer::pressures;
  it.law.values =
      PressureVector::LinSpaced(12, 0.0, 2.0 + 1e-9);  // rounding of a float is no fault
  test::PressureLimits limits(experiment);
  for (int k = 0; k < 600; ++k) ASSERT_STREQ(limits.violation(it.tick()), "");
  ASSERT_EQ(it.bench->pipeline.output().mode, Mode::active);
  const PressureVector wanted = it.law.values.cwiseMin(2.0);
  EXPECT_EQ(it.bench->pipeline.output().pressure_bar, wanted);
}

TEST(ExternalLaw, SilenceHoldsAndThenVents) {
  ExternalLawBench it;
  it.law.values.setConstant(0.2);
  it.run(600);
  const PressureVector before = it.bench->pipeline.output().pressure_bar;
  it.answers = false;
  // The newest answered the tick before the last: 50 ms from there, its validity.
  int ticks = 0;
  while (it.tick().mode == Mode::active && ticks < 1000) ++ticks;
  EXPECT_EQ(ticks, 24) << "2 ms each; the newest state was 2 ms old already";
  EXPECT_EQ(it.bench->pipeline.output().mode, Mode::hold);
  EXPECT_EQ(it.bench->pipeline.output().reason, Reason::law_late);
  EXPECT_EQ(it.bench->pipeline.output().pressure_bar, before);
  for (ticks = 0; it.tick().mode == Mode::hold && ticks < 1000;) ++ticks;
  EXPECT_EQ(ticks, 49) << "safety.law_vent_after_s 0.1";
  EXPECT_EQ(it.bench->pipeline.output().mode, Mode::vent);
  EXPECT_EQ(it.bench->pipeline.output().reason, Reason::law_silent);
  it.run(300);
  EXPECT_TRUE(it.bench->pipeline.fully_vented());
  it.answers = true;
  EXPECT_EQ(it.run(300).mode, Mode::active) << "automatic arming: as after stale frames";
}

TEST(ExternalLaw, NoAnswerCountsLongerThanTheDaemonGrants) {
  ExternalLawBench it;
  it.law.validity_ns = kForever;
  it.run(600);
  it.answers = false;
  it.run(48);
  EXPECT_EQ(it.bench->pipeline.output().mode, Mode::active);
  it.run(2);
  EXPECT_EQ(it.bench->pipeline.output().mode, Mode::hold) << "safety.law_validity_s 0.1";
}

TEST(ExternalLaw, WhatCannotBeIsRefusedCountedAndNotCommanded) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  ExternalLawBench it;
  it.law.values.setConstant(0.2);
  it.run(600);
  const PressureVector before = it.bench->pipeline.output().pressure_bar;
  const auto refused = [&](LawVerdict why, const auto& change) {
    const LawInput good = it.law;
    const std::int64_t counted = it.count(why), accepted = it.count(LawVerdict::accepted);
    change();
    it.run(3);
    EXPECT_EQ(it.count(why), counted + 3) << name(why);
    EXPECT_EQ(it.count(LawVerdict::accepted), accepted);
    EXPECT_EQ(it.bench->pipeline.output().mode, Mode::active) << "the answer before still counts";
    EXPECT_EQ(it.bench->pipeline.output().pressure_bar, before) << name(why);
    it.law = good;
    it.state_ns = -1;
    it.run(10);
  };
  refused(LawVerdict::not_finite, [&] { it.law.values[3] = kNan; });
  refused(LawVerdict::not_finite, [&] { it.law.values[0] = HUGE_VAL; });
  refused(LawVerdict::wrong_size, [&] { it.law.values = PressureVector::Zero(5); });
  refused(LawVerdict::wrong_size, [&] { it.law.values.resize(0); });
  refused(LawVerdict::out_of_limits, [&] { it.law.values[5] = -1e3; });
  const auto pressures = [&](double bar) {
    it.law.answer = LawAnswer::pressures;
    it.law.values = PressureVector::Constant(12, bar);
  };
  refused(LawVerdict::out_of_limits, [&] { pressures(2.01); });
  refused(LawVerdict::out_of_limits, [&] { pressures(-0.01); });
  refused(LawVerdict::not_finite, [&] { pressures(kNan); });
  refused(LawVerdict::expired, [&] { it.state_ns = it.bench->now_ns - 60 * kMs; });
  refused(LawVerdict::expired, [&] { it.law.validity_ns = 0; });
  refused(LawVerdict::expired, [&] { it.law.validity_ns = -5; });
  refused(LawVerdict::not_recent, [&] { it.state_ns = it.bench->now_ns + 1000 * kMs; });
}

TEST(ExternalLaw, AlongAnArmThatStretchesForcesOutOfAllProportionAreRefused) {
  Experiment experiment = load_experiment(SOFTARM_SOURCE_DIR "/config/paper_arm_stretching.yaml");
  experiment.control.law = ExternalLaw{};
  for (int row = 0; row < 3; ++row) {
    ExternalLawBench it(experiment);
    it.law.values = PressureVector::Zero(9);
    it.law.values[3 + row] = row < 2 ? 1e3 : 1e5;  // N m; N
    it.run(300);
    EXPECT_EQ(it.count(LawVerdict::out_of_limits), it.sent) << row;
    EXPECT_GT(it.sent, 0);
  }
}

/// A force out of reach is no fault of the law: it is scaled as that of (17) is.
TEST(ExternalLaw, ForceOutOfReachIsScaled) {
  ExternalLawBench it;
  it.law.values.setConstant(3.0);
  EXPECT_EQ(it.run(600).mode, Mode::active);
  EXPECT_TRUE(it.bench->pipeline.output().saturated);
  EXPECT_LE(it.bench->pipeline.output().pressure_bar.maxCoeff(), 2.0);
}

TEST(ExternalLaw, TakesNoMemory) {
  ExternalLawBench it;
  it.law.values.setConstant(0.2);
  const long allocated = test::thread_allocations, released = test::thread_releases;
  for (int k = 0; k < 3000; ++k) {
    it.answers = k % 1000 < 800;
    it.law.values[0] = k % 13 == 0 ? std::nan("") : 0.2;
    it.tick();
  }
  EXPECT_EQ(test::thread_allocations - allocated, 0);
  EXPECT_EQ(test::thread_releases - released, 0);
}

}  // namespace
}  // namespace softarm
