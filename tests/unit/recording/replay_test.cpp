// Logs of runs in lock step, whole, lossy, damaged and forged, against softarm replay's core.
#include "softarm/recording/replay.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <memory>
#include <sstream>

#include "softarm/transport/message_decoding.hpp"
#include "unit/recording/recorded_log.hpp"

namespace softarm {
namespace {

using test::LogBytes;
using test::Losses;

Experiment paper_arm() {
  return load_experiment(std::filesystem::path(SOFTARM_SOURCE_DIR) / "config" / "paper_arm.yaml");
}

struct Outcome {
  ReplaySummary summary;
  std::int64_t damages = 0;
  std::vector<LogDamage> damage;
};

Outcome replay(const std::string& bytes, const Experiment& experiment, bool any = false) {
  std::istringstream stream(bytes);
  EventLogReader log(stream);
  Replay replay(experiment, "this build", any);
  for (LogEvent event; log.next(event);) replay.take(event);
  replay.finish();
  return {replay.summary(), log.damage_count(), log.damages()};
}

/// Events of one channel, in order.
std::vector<LogEvent> events_on(const std::string& bytes, const std::string& channel,
                                std::vector<std::size_t>& ends) {
  std::istringstream stream(bytes);
  EventLogReader log(stream);
  std::vector<LogEvent> found;
  for (LogEvent event; log.next(event);) {
    if (event.channel != channel) continue;
    ends.push_back(static_cast<std::size_t>(event.position) + 28 + channel.size() +
                   event.data.size());
    found.push_back(event);
  }
  return found;
}

class LockStepReplay : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { run_ = test::record_run(experiment_, 5.0, false, log_); }
  static inline const Experiment experiment_ = paper_arm();
  static inline LogBytes log_;
  static inline test::RecordedRun run_;
};

TEST_F(LockStepReplay, ARunWithFaultsIsReproducedBitForBit) {
  for (const Mode mode : {Mode::wait_frames, Mode::active, Mode::hold, Mode::vent})
    EXPECT_GT(std::count(run_.modes.begin(), run_.modes.end(), mode), 5) << name(mode);
  const ReplaySummary summary = replay(log_.bytes, experiment_).summary;
  EXPECT_TRUE(summary.complete());
  EXPECT_EQ(summary.runs, 1);
  EXPECT_EQ(summary.ticks, run_.ticks);
  for (const ReplayCount& count : {summary.records, summary.commands, summary.statuses}) {
    EXPECT_EQ(count.compared, run_.ticks);
    EXPECT_EQ(count.different, 0);
  }
  EXPECT_FALSE(summary.other_build);
  EXPECT_EQ(summary.recorded_build, "this build");
}

TEST(Replay, AnArmThatStretchesIsReproducedBitForBit) {
  const Experiment experiment = load_experiment(std::filesystem::path(SOFTARM_SOURCE_DIR) /
                                                "config" / "paper_arm_stretching.yaml");
  LogBytes log;
  const test::RecordedRun run = test::record_run(experiment, 3.0, false, log);
  EXPECT_GT(std::count(run.modes.begin(), run.modes.end(), Mode::active), 100);
  const ReplaySummary summary = replay(log.bytes, experiment).summary;
  EXPECT_TRUE(summary.complete()) << summary.ticks << " ticks, " << summary.gap_count << " gaps, "
                                  << summary.malformed << " malformed";
  for (const FieldDifference& each : summary.first.fields)
    ADD_FAILURE() << each.field << ": " << each.recorded << ", " << each.replayed;
}

TEST(Replay, AnExternalLawAndTargetsOfTheTipAreReproducedToo) {
  Experiment experiment = paper_arm();
  experiment.control.law = ExternalLaw{};
  experiment.reference.phases.insert(experiment.reference.phases.begin(),
                                     {LiveTipReference{}, 1.0});
  LogBytes log;
  const test::RecordedRun run = test::record_run(experiment, 4.0, false, log);
  for (const Mode mode : {Mode::wait_frames, Mode::active, Mode::hold, Mode::vent})
    EXPECT_GT(std::count(run.modes.begin(), run.modes.end(), mode), 5) << name(mode);
  const ReplaySummary summary = replay(log.bytes, experiment).summary;
  EXPECT_TRUE(summary.complete());
  EXPECT_EQ(summary.records.compared, run.ticks);
  EXPECT_EQ(summary.statuses.compared, run.ticks);
}

// The pipeline is a function of its inputs alone: not of what its memory held before, either.
TEST_F(LockStepReplay, WhatMemoryHeldBeforeMakesNoDifference) {
  struct alignas(ControlPipeline) Storage {
    unsigned char bytes[sizeof(ControlPipeline)];
  };
  std::vector<std::uint64_t> expected;
  for (const int filling : {0x00, 0x5a, 0xff}) {
    const auto storage = std::make_unique<Storage>();
    std::memset(storage->bytes, filling, sizeof storage->bytes);
    __asm__ volatile("" : : "r"(storage.get()) : "memory");  // or the filling is left out
    const std::unique_ptr<ControlPipeline, void (*)(ControlPipeline*)> pipeline(
        new (storage.get()) ControlPipeline(experiment_),
        [](ControlPipeline* p) { std::destroy_at(p); });
    std::istringstream stream(log_.bytes);
    EventLogReader log(stream);
    softarm_messages::tick_record_t record{};
    RecordedInput input;
    std::vector<std::uint64_t> said;
    std::int64_t tick = 0;
    for (LogEvent event; log.next(event);) {
      if (event.channel != experiment_.transport.lcm.tick_channel) continue;
      ASSERT_TRUE(decode(event.data, record));
      if (record.tick <= tick) continue;  // its repetition
      tick = record.tick;
      const TickOutput& output = pipeline->tick(input.from(record));
      for (const double each : output.pressure_bar)
        said.push_back(std::bit_cast<std::uint64_t>(each));
      for (const double each : output.motion.u_rad)
        said.push_back(std::bit_cast<std::uint64_t>(each));
    }
    EXPECT_EQ(tick, run_.ticks);
    if (expected.empty()) expected = said;
    EXPECT_EQ(said, expected) << "memory filled with " << filling;
  }
}

TEST_F(LockStepReplay, TorquesAndShadowToo) {
  Experiment experiment = experiment_;
  for (ActuationSettings* actuation : {&experiment.actuation, &experiment.plant.actuation})
    set_torque_actuation(*actuation, 3, 2.0);
  LogBytes log;
  const auto run = test::record_run(experiment, 3.0, true, log);
  const ReplaySummary summary = replay(log.bytes, experiment).summary;
  EXPECT_TRUE(summary.complete());
  EXPECT_EQ(summary.commands.compared, run.ticks);
}

TEST_F(LockStepReplay, TheModelObserverToo) {
  Experiment experiment = experiment_;
  experiment.estimation.observer = ObserverKind::model;
  LogBytes log;
  const auto run = test::record_run(experiment, 5.0, false, log);
  const ReplaySummary summary = replay(log.bytes, experiment).summary;
  EXPECT_TRUE(summary.complete());
  EXPECT_FALSE(summary.different());
  EXPECT_EQ(summary.commands.compared, run.ticks);
}

TEST_F(LockStepReplay, WhatIsLearntAlongAPeriodToo) {
  Experiment experiment = experiment_;
  experiment.estimation.observer = ObserverKind::model;
  experiment.estimation.model_observer.learn_parameters = false;  // settled from the beginning
  PaperReference fast;
  fast.rate_radps = 12.0;
  experiment.reference.phases = {{fast, 0.0}};
  Experiment without = experiment;
  experiment.control.repetition.lead_s = 0.05;
  LogBytes log;
  const auto run = test::record_run(experiment, 15.0, false, log);
  const ReplaySummary summary = replay(log.bytes, experiment).summary;
  EXPECT_TRUE(summary.complete());
  EXPECT_FALSE(summary.different());
  EXPECT_EQ(summary.commands.compared, run.ticks);
  // It was there to be reproduced.
  EXPECT_TRUE(replay(log.bytes, without, true).summary.different());
}

TEST_F(LockStepReplay, AFlippedBitInACommandIsFoundAndNamed) {
  std::vector<std::size_t> ends;
  const auto commands = events_on(log_.bytes, experiment_.transport.lcm.command_channel, ends);
  std::string other = log_.bytes;
  other[ends[899] - 4 * 12 + 4 * 7 + 3] ^= 1;  // the last bit of pressure 7 of 12
  const ReplaySummary summary = replay(other, experiment_).summary;
  ASSERT_TRUE(summary.different());
  EXPECT_EQ(summary.commands.different, 1);
  EXPECT_EQ(summary.records.different + summary.statuses.different, 0);
  EXPECT_EQ(summary.first.tick, 900);
  EXPECT_EQ(summary.first.position, commands[899].position);
  ASSERT_EQ(summary.first.fields.size(), 1u);
  EXPECT_EQ(summary.first.fields[0].field, "command.pressure_bar[7]");
  EXPECT_EQ(summary.first.fields[0].unit, "bar");
  EXPECT_NE(summary.first.fields[0].recorded, summary.first.fields[0].replayed);
}

TEST_F(LockStepReplay, ALoggerThatMissesATenthOfASecondLosesNothing) {
  for (const std::int64_t first : {1, 400, 2450}) {
    LogBytes log;
    const auto run = test::record_run(experiment_, 5.0, false, log, {[&](auto tick, int copy) {
                                        const auto sent = copy == 1 ? tick : tick + 50;
                                        return sent < first || sent >= first + 50;
                                      }});
    const ReplaySummary summary = replay(log.bytes, experiment_).summary;
    EXPECT_TRUE(summary.complete()) << first;
    EXPECT_EQ(summary.statuses.compared, run.ticks);
  }
}

TEST_F(LockStepReplay, AGapIsReportedAndNothingAfterItIsProof) {
  LogBytes log;
  const auto run = test::record_run(experiment_, 5.0, false, log,
                                    {[](auto tick, int) { return tick < 1000 || tick >= 1100; }});
  const ReplaySummary summary = replay(log.bytes, experiment_).summary;
  EXPECT_FALSE(summary.complete());
  EXPECT_FALSE(summary.different());
  EXPECT_EQ(summary.records.compared, 999);
  EXPECT_EQ(summary.missing_ticks, 100);
  ASSERT_EQ(summary.gaps.size(), 1u);
  EXPECT_EQ(summary.gaps[0].first, 1000);
  EXPECT_EQ(summary.gaps[0].last, 1099);
  EXPECT_EQ(summary.after_gap.compared, run.ticks - 1099);
  EXPECT_GT(summary.agrees_again, 1099) << "vented in the end";
}

TEST_F(LockStepReplay, AnotherRunBeginsAgainAndALateLoggerIsReported) {
  LogBytes log;
  const auto late = [](auto tick, int) { return tick > 700; };
  const auto first = test::record_run(experiment_, 3.0, false, log, {late});
  const auto second = test::record_run(experiment_, 2.0, true, log, {}, 90'000'000'000);
  const ReplaySummary summary = replay(log.bytes, experiment_).summary;
  EXPECT_EQ(summary.runs, 2);
  ASSERT_EQ(summary.gaps.size(), 1u);
  EXPECT_EQ(summary.gaps[0].first, 1);
  EXPECT_EQ(summary.gaps[0].last, 700);
  EXPECT_EQ(summary.after_gap.compared, first.ticks - 700);
  EXPECT_EQ(summary.records.compared, second.ticks);
  EXPECT_EQ(summary.commands.compared, second.ticks);
  EXPECT_FALSE(summary.different());
}

TEST_F(LockStepReplay, CutAndDamagedLogsAreUsedBeforeAndAfter) {
  const Outcome cut = replay(log_.bytes.substr(0, log_.bytes.size() / 2 + 13), experiment_);
  EXPECT_EQ(cut.damages, 1);
  EXPECT_EQ(cut.damage.at(0).end, static_cast<std::int64_t>(log_.bytes.size() / 2 + 13));
  EXPECT_GT(cut.summary.ticks, run_.ticks / 3);
  EXPECT_EQ(cut.summary.records.different, 0);

  std::vector<std::size_t> ends;
  const auto records = events_on(log_.bytes, experiment_.transport.lcm.tick_channel, ends);
  // A record whose numbers are damaged is no input: its repetition serves.
  std::string numbers = log_.bytes;
  numbers[ends[1200] - 60] ^= 0x10;
  const Outcome changed = replay(numbers, experiment_);
  EXPECT_EQ(changed.summary.malformed, 1);
  EXPECT_EQ(changed.summary.records.compared, run_.ticks);
  EXPECT_FALSE(changed.summary.different());
  EXPECT_FALSE(changed.summary.complete());

  // A damaged range of the log that costs less than a tenth of a second costs no tick.
  std::string torn = log_.bytes;
  const std::int64_t from = records[700].position + 20;
  std::fill_n(torn.begin() + from, 30'000, '\x5a');
  const Outcome hole = replay(torn, experiment_);
  EXPECT_EQ(hole.damages, 1);
  EXPECT_EQ(hole.damage.at(0).begin, records[700].position);
  EXPECT_GE(hole.damage.at(0).end, from + 30'000);
  EXPECT_EQ(hole.summary.records.compared, run_.ticks);
  EXPECT_LT(hole.summary.commands.compared, run_.ticks);
  EXPECT_FALSE(hole.summary.different());
  EXPECT_EQ(hole.summary.gap_count, 0);
}

TEST_F(LockStepReplay, AnotherConfigurationIsRefusedOrComparedOnDemand) {
  Experiment other = experiment_;
  other.hash ^= 1;
  EXPECT_THROW(replay(log_.bytes, other), OtherConfiguration);
  EXPECT_TRUE(replay(log_.bytes, other, true).summary.complete());
  other.control.kp.assign(6, 0.9);
  const ReplaySummary summary = replay(log_.bytes, other, true).summary;
  ASSERT_TRUE(summary.different());
  const auto active = std::find(run_.modes.begin(), run_.modes.end(), Mode::active);
  EXPECT_GE(summary.first.tick, active - run_.modes.begin()) << "gains matter only under control";
  const auto has = [&](const char* prefix) {
    return std::any_of(summary.first.fields.begin(), summary.first.fields.end(),
                       [&](const auto& each) { return each.field.starts_with(prefix); });
  };
  EXPECT_TRUE(has("tick.command"));
  EXPECT_TRUE(has("status.tau_actuation_nm"));
}

TEST_F(LockStepReplay, RecordsOfAnotherArmAreNoInput) {
  const Experiment other =
      load_experiment(std::filesystem::path(SOFTARM_SOURCE_DIR) / "config" / "one_segment.yaml");
  const ReplaySummary summary = replay(log_.bytes, other, true).summary;
  EXPECT_EQ(summary.ticks, 0);
  EXPECT_EQ(summary.malformed, 2 * run_.ticks);
  EXPECT_FALSE(summary.complete());
}

}  // namespace
}  // namespace softarm
