// Every row of the table of causes, with time stepped by hand: what it demands, from which modes,
// and what it takes to be active again.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "milliseconds.hpp"
#include "softarm/runtime/activation_limit.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {
namespace {

using test::kMs;
constexpr double kPeriod_s = 0.002;
constexpr int kGoodFrames = 50;

/// A monitor at 500 Hz whose every input is healthy until a test says otherwise.
class Bench {
 public:
  explicit Bench(Arming arming) : monitor(settings(arming), kPeriod_s) {
    input.deadman_used = input.law_used = true;
    input.fully_vented = true;
  }

  Mode tick() {
    input.now_ns += 2 * kMs + std::exchange(gap_ns, 0);
    input.good_frames = frames ? 1 : 0;
    if (frames) input.newest_capture_ns = input.now_ns - 5 * kMs;
    if (measurements) input.newest_measurement_ns = input.now_ns;
    if (go) input.newest_go_ns = input.now_ns;
    if (law) input.law_until_ns = input.now_ns + 100 * kMs;  // as a daemon grants
    if (limit) input.activated_too_often = limit->reached(input.now_ns, monitor);
    const Mode mode = monitor.step(input);
    if (limit) limit->note(input.now_ns, last_mode, input.requests.arm, monitor);
    input.requests.arm = input.requests.disarm = input.requests.emergency_stop =
        input.requests.lost = input.sender_restarted = false;
    // Pressure is there after a while under control, and gone after a while of venting.
    ticks_in_mode = mode == last_mode ? ticks_in_mode + 1 : 0;
    last_mode = mode;
    if (mode == Mode::active) input.fully_vented = false;
    if (mode >= Mode::vent && ticks_in_mode > 100) input.fully_vented = true;
    return mode;
  }
  Mode run(int ticks) {
    for (int k = 0; k < ticks; ++k) tick();
    return monitor.mode();
  }
  void activate() {
    run(kGoodFrames + 1);
    if (!monitor.armed()) {
      input.requests.arm = true;
      tick();
    }
    ASSERT_EQ(monitor.mode(), Mode::active) << name(monitor.reason());
  }

  SafetyMonitor monitor;
  std::optional<ActivationLimit> limit;  ///< none: the input says it
  SafetyInput input{.now_ns = 1'000'000'000};
  bool frames = true, measurements = true, go = true, law = true;
  std::int64_t gap_ns = 0;

 private:
  static SafetySettings settings(Arming arming) {
    SafetySettings chosen;
    chosen.arming = arming;
    chosen.frame_latency_s = 0.005;
    chosen.valve_readback = true;
    return chosen;
  }
  int ticks_in_mode = 0;
  Mode last_mode = Mode::init;
};

struct Row {
  Reason reason;
  Mode mode;  ///< that it leads to from ACTIVE
  Clearance clearance;
  bool pressurised;  ///< only where there is pressure, or may be
  int after_ticks;   ///< at the latest
  std::function<void(Bench&)> cause, remove;
};

void PrintTo(const Row& row, std::ostream* out) { *out << name(row.reason) << name(row.mode); }

/// Written from what the reaction must be (docs/reference/faults.md), not from the table in the code.
const std::vector<Row>& rows() {
  const auto nothing = [](Bench&) {};
  static const std::vector<Row> kRows{
      {Reason::shutdown, Mode::vent, Clearance::never, false, 1,
       [](Bench& b) { b.input.requests.shutdown = true; }, nothing},
      {Reason::emergency_stop, Mode::fault, Clearance::disarm_then_arm, false, 1,
       [](Bench& b) { b.input.requests.emergency_stop = true; }, nothing},
      {Reason::valves_silent, Mode::fault, Clearance::disarm_then_arm, true, 52,
       [](Bench& b) { b.measurements = false; }, [](Bench& b) { b.measurements = true; }},
      {Reason::pressure_mismatch, Mode::fault, Clearance::disarm_then_arm, true, 1,
       [](Bench& b) { b.input.pressure_mismatch = true; },
       [](Bench& b) { b.input.pressure_mismatch = false; }},
      {Reason::curvature_mismatch, Mode::fault, Clearance::disarm_then_arm, false, 1,
       [](Bench& b) { b.input.curvature_mismatch = true; },
       [](Bench& b) { b.input.curvature_mismatch = false; }},
      {Reason::wrong_model, Mode::fault, Clearance::disarm_then_arm, false, 1,
       [](Bench& b) { b.input.wrong_model = true; }, [](Bench& b) { b.input.wrong_model = false; }},
      {Reason::length_mismatch, Mode::fault, Clearance::disarm_then_arm, true, 1,
       [](Bench& b) { b.input.length_mismatch = true; },
       [](Bench& b) { b.input.length_mismatch = false; }},
      {Reason::disarmed, Mode::vent, Clearance::arm, false, 1,
       [](Bench& b) { b.input.requests.disarm = true; }, nothing},
      {Reason::deadman_released, Mode::vent, Clearance::arm, false, 102,
       [](Bench& b) { b.go = false; }, [](Bench& b) { b.go = true; }},
      {Reason::requests_lost, Mode::vent, Clearance::arm, false, 1,
       [](Bench& b) { b.input.requests.lost = true; }, nothing},
      {Reason::foreign_commands, Mode::vent, Clearance::arm, false, 1,
       [](Bench& b) { b.input.newest_foreign_ns = b.input.now_ns; },
       [](Bench& b) { b.input.newest_foreign_ns = kNever; }},
      {Reason::soft_limit, Mode::vent, Clearance::arm, false, 1,
       [](Bench& b) { b.input.soft_limit_exceeded = true; },
       [](Bench& b) { b.input.soft_limit_exceeded = false; }},
      {Reason::oscillation, Mode::vent, Clearance::arm, false, 1,
       [](Bench& b) { b.input.oscillation = true; }, [](Bench& b) { b.input.oscillation = false; }},
      {Reason::contact_vented, Mode::vent, Clearance::arm, false, 1,
       [](Bench& b) { b.input.contact_vents = true; },
       [](Bench& b) { b.input.contact_vents = false; }},
      {Reason::time_gap, Mode::vent, Clearance::good_frames, false, 1,
       [](Bench& b) { b.gap_ns = 150 * kMs; }, nothing},
      {Reason::command_expired, Mode::vent, Clearance::good_frames, false, 1,
       [](Bench& b) { b.input.command_expired = true; },
       [](Bench& b) { b.input.command_expired = false; }},
      {Reason::sender_restarted, Mode::vent, Clearance::good_frames, false, 1,
       [](Bench& b) { b.input.sender_restarted = true; }, nothing},
      {Reason::frames_stale, Mode::vent, Clearance::good_frames, false, 50,
       [](Bench& b) { b.frames = false; }, [](Bench& b) { b.frames = true; }},
      {Reason::activated_too_often, Mode::vent, Clearance::arm, false, 1,
       [](Bench& b) { b.input.activated_too_often = true; },
       [](Bench& b) { b.input.activated_too_often = false; }},
      {Reason::law_silent, Mode::vent, Clearance::good_frames, false, 101,
       [](Bench& b) { b.law = false; }, [](Bench& b) { b.law = true; }},
      {Reason::frame_period_mismatch, Mode::vent, Clearance::good_frames, false, 1,
       [](Bench& b) { b.input.frame_period_mismatch = true; },
       [](Bench& b) { b.input.frame_period_mismatch = false; }},
      {Reason::many_overruns, Mode::vent, Clearance::good_frames, false, 1,
       [](Bench& b) { b.input.consecutive_overruns = 10; },
       [](Bench& b) { b.input.consecutive_overruns = 0; }},
      {Reason::frames_late, Mode::hold, Clearance::good_frames, false, 1,
       [](Bench& b) { b.input.motion_unknown = true; },
       [](Bench& b) { b.input.motion_unknown = false; }},
      {Reason::law_late, Mode::hold, Clearance::good_frames, false, 51,
       [](Bench& b) { b.law = false; }, [](Bench& b) { b.law = true; }},
      {Reason::poses_frozen, Mode::hold, Clearance::good_frames, false, 1,
       [](Bench& b) { b.input.poses_frozen = true; },
       [](Bench& b) { b.input.poses_frozen = false; }},
      {Reason::contact, Mode::hold, Clearance::good_frames, false, 1,
       [](Bench& b) { b.input.contact_holds = true; },
       [](Bench& b) { b.input.contact_holds = false; }},
      {Reason::overruns, Mode::hold, Clearance::good_frames, false, 1,
       [](Bench& b) { b.input.consecutive_overruns = 3; },
       [](Bench& b) { b.input.consecutive_overruns = 0; }},
  };
  return kRows;
}

class CauseTable : public ::testing::TestWithParam<Row> {};

TEST_P(CauseTable, FromActiveItLeadsThere) {
  const Row& row = GetParam();
  for (const Arming arming : {Arming::automatic, Arming::explicit_}) {
    Bench bench(arming);
    bench.activate();
    row.cause(bench);
    int ticks = 0;
    do {
      bench.tick();
    } while (++ticks < row.after_ticks && bench.monitor.mode() != row.mode);
    EXPECT_EQ(bench.monitor.mode(), row.mode);
    EXPECT_EQ(bench.monitor.reason(), row.reason) << name(bench.monitor.reason());
  }
}

TEST_P(CauseTable, ItKeepsTheArmFromBecomingActive) {
  const Row& row = GetParam();
  Bench bench(Arming::automatic);
  // Some causes take a while; no frames come meanwhile. Then enough of them, nearly.
  bench.frames = false;
  if (row.after_ticks > 1) row.cause(bench);
  bench.run(row.after_ticks);
  bench.frames = row.reason != Reason::frames_stale;
  bench.run(kGoodFrames - 5);
  ASSERT_EQ(bench.monitor.mode(), Mode::wait_frames);
  row.cause(bench);
  const bool lasts = row.reason != Reason::time_gap && row.reason != Reason::sender_restarted &&
                     row.reason != Reason::disarmed && row.reason != Reason::requests_lost;
  const bool latches =
      row.reason == Reason::shutdown || (row.mode == Mode::fault && !row.pressurised);
  for (int k = 0; k < 400; ++k) {  // longer than what queued up in a stop counts for nothing
    const Mode mode = bench.tick();
    if (lasts || k < 5) {
      ASSERT_NE(mode, Mode::active) << k;
    }
    if (!latches) {
      ASSERT_LE(mode, Mode::active) << "nothing is pressurised: nothing to hold or vent";
    }
  }
  if (latches) {
    EXPECT_EQ(bench.monitor.mode(), row.mode);
  }
  if (!lasts && row.clearance != Clearance::arm) {
    EXPECT_EQ(bench.monitor.mode(), Mode::active);
  }
}

TEST_P(CauseTable, OnlyWhatMustClearItDoes) {
  const Row& row = GetParam();
  for (const Arming arming : {Arming::automatic, Arming::explicit_}) {
    SCOPED_TRACE(arming == Arming::automatic ? "automatic" : "explicit");
    Bench bench(arming);
    bench.activate();
    row.cause(bench);
    bench.run(row.after_ticks);
    ASSERT_EQ(bench.monitor.mode(), row.mode);
    row.remove(bench);

    // Good frames alone.
    const bool alone = row.clearance == Clearance::good_frames &&
                       (row.mode == Mode::hold || arming == Arming::automatic);
    EXPECT_EQ(bench.run(400) == Mode::active, alone);
    if (alone) continue;
    EXPECT_FALSE(bench.monitor.armed());

    bench.input.requests.arm = true;
    const bool by_arm = row.clearance == Clearance::good_frames || row.clearance == Clearance::arm;
    EXPECT_EQ(bench.run(2) == Mode::active, by_arm);
    if (by_arm) continue;
    EXPECT_FALSE(bench.monitor.armed()) << "an arm must not be stored up";

    bench.input.requests.disarm = true;
    EXPECT_EQ(bench.run(400), row.clearance == Clearance::never ? row.mode : Mode::vent);
    bench.input.requests.arm = true;
    EXPECT_EQ(bench.run(2) == Mode::active, row.clearance == Clearance::disarm_then_arm);
  }
}

TEST_P(CauseTable, WhatIsLessSevereDoesNotHideIt) {
  const Row& severe = GetParam();
  for (const Row& other : rows()) {
    if (other.mode >= severe.mode || other.reason == Reason::shutdown) continue;
    // Fewer overruns are no second cause beside many.
    if (severe.reason == Reason::many_overruns && other.reason == Reason::overruns) continue;
    Bench bench(Arming::automatic);
    bench.activate();
    other.cause(bench);
    severe.cause(bench);
    for (int k = 0; k < severe.after_ticks; ++k) {
      other.cause(bench);
      bench.tick();
    }
    EXPECT_EQ(bench.monitor.mode(), severe.mode) << "beside " << name(other.reason);
  }
}

INSTANTIATE_TEST_SUITE_P(Rows, CauseTable, ::testing::ValuesIn(rows()),
                         [](const auto& each) { return std::string(name(each.param.reason)); });

TEST(CauseTableInCode, SaysWhatIsTestedHereAndNoMore) {
  for (const CauseRule& rule : cause_table()) {
    // A second row of a reason is for an arm without pressure, which it only keeps waiting.
    const auto row = std::find_if(rows().begin(), rows().end(),
                                  [&](const Row& each) { return each.reason == rule.reason; });
    ASSERT_NE(row, rows().end()) << name(rule.reason);
    if (row->pressurised && rule.demands == Mode::vent) continue;
    EXPECT_EQ(rule.demands, row->mode) << name(rule.reason);
    EXPECT_EQ(rule.clearance, row->clearance) << name(rule.reason);
  }
}

/// Frames fail and come again, for so many activations or ticks.
int activations_of(Bench& bench, int ticks) {
  int activations = 0;
  Mode before = bench.monitor.mode();
  for (int k = 0; k < ticks; ++k) {
    bench.frames = k % 250 < 170;
    const Mode mode = bench.tick();
    if (mode == Mode::active && before != Mode::active) ++activations;
    before = mode;
  }
  return activations;
}

TEST(ActivatedTooOften, AnAutomaticArmStaysVentedUntilItIsArmedByHand) {
  Bench bench(Arming::automatic);
  bench.limit.emplace(SafetySettings{});
  EXPECT_EQ(activations_of(bench, 20000), 5) << "of forty in 40 s";
  EXPECT_EQ(bench.monitor.mode(), Mode::vent);
  EXPECT_FALSE(bench.monitor.armed());
  bench.frames = true;
  bench.run(60'000);  // two minutes later it still does
  EXPECT_EQ(bench.monitor.mode(), Mode::vent);
  EXPECT_EQ(bench.monitor.reason(), Reason::waiting_for_arm);
  bench.input.requests.arm = true;
  EXPECT_EQ(bench.tick(), Mode::active);
  EXPECT_EQ(activations_of(bench, 20000), 4) << "five in the minute that began with the arm";
}

TEST(ActivatedTooOften, NamesItself) {
  Bench bench(Arming::automatic);
  bench.limit.emplace(SafetySettings{});
  bool named = false;
  for (int k = 0; k < 20000; ++k) {
    bench.frames = k % 250 < 170;
    bench.tick();
    named |= bench.monitor.reason() == Reason::activated_too_often;
  }
  EXPECT_TRUE(named);
}

TEST(ActivatedTooOften, OnceAMinuteIsNotTooOftenNorIsLeavingHold) {
  Bench bench(Arming::automatic);
  bench.limit.emplace(SafetySettings{});
  for (int k = 0; k < 12; ++k) {
    bench.frames = true;
    ASSERT_EQ(bench.run(7'000), Mode::active) << k;  // 14 s
    bench.frames = false;
    ASSERT_EQ(bench.run(80), Mode::vent);
  }
  bench.frames = true;
  ASSERT_EQ(bench.run(7'000), Mode::active);
  for (int k = 0; k < 100; ++k) {
    bench.input.poses_frozen = true;
    ASSERT_EQ(bench.tick(), Mode::hold);
    bench.input.poses_frozen = false;
    ASSERT_EQ(bench.run(60), Mode::active) << k;
  }
}

TEST(ActivatedTooOften, WhereAnOperatorArmsEveryTimeItIsTheOperatorsDecision) {
  Bench bench(Arming::explicit_);
  bench.limit.emplace(SafetySettings{});
  for (int k = 0; k < 20; ++k) {
    bench.frames = true;
    bench.run(400);
    bench.input.requests.arm = true;
    ASSERT_EQ(bench.tick(), Mode::active) << k;
    bench.frames = false;
    ASSERT_EQ(bench.run(80), Mode::vent);
  }
}

TEST(ActivatedTooOften, TheMinuteHasItsLastInstant) {
  Bench active(Arming::automatic), vented(Arming::automatic);
  active.activate();
  vented.activate();
  vented.frames = false;
  ASSERT_EQ(vented.run(80), Mode::vent);
  SafetySettings settings;
  settings.most_activations = 2;
  ActivationLimit limit(settings);
  constexpr std::int64_t kBegin = 7 * kMs, kMinute = 60'000 * kMs;
  limit.note(kBegin, Mode::vent, false, active.monitor);
  limit.note(kBegin + kMinute, Mode::vent, false, active.monitor);
  EXPECT_TRUE(limit.reached(kBegin + kMinute, vented.monitor));
  EXPECT_FALSE(limit.reached(kBegin + kMinute + 1, vented.monitor));
}

TEST(SafetyInput, AssumesPressureUntilSomebodyHasLooked) {
  EXPECT_FALSE(SafetyInput{}.fully_vented);
}

TEST(Refused, FramesThatComeAndAreRefusedAreNamedSo) {
  Bench bench(Arming::automatic);
  bench.frames = false;
  bench.input.frames_refused = true;
  bench.run(100);
  EXPECT_EQ(bench.monitor.mode(), Mode::wait_frames);
  EXPECT_EQ(bench.monitor.reason(), Reason::frames_refused);
  bench.frames = true;
  bench.input.frames_refused = false;
  bench.activate();
  bench.frames = false;
  bench.input.frames_refused = true;
  bench.run(20);
  EXPECT_EQ(bench.monitor.mode(), Mode::hold);
  EXPECT_EQ(bench.monitor.reason(), Reason::frames_refused);
  bench.run(50);
  EXPECT_EQ(bench.monitor.mode(), Mode::vent);
  EXPECT_EQ(bench.monitor.reason(), Reason::frames_refused);
}

TEST(Waiting, AVentedArmWaitsForAnArmOnlyWhereNothingElseHoldsIt) {
  Bench bench(Arming::explicit_);
  bench.activate();
  bench.input.requests.disarm = true;
  bench.run(400);
  ASSERT_EQ(bench.monitor.reason(), Reason::waiting_for_arm);
  bench.input.bad_frames = 1;  // one bad frame: fifty more are needed
  bench.input.frames_refused = true;
  bench.tick();
  EXPECT_EQ(bench.monitor.reason(), Reason::frames_refused);
  bench.input.bad_frames = 0;
  bench.input.frames_refused = false;
  bench.run(10);
  EXPECT_EQ(bench.monitor.reason(), Reason::frames_refused) << "until fifty are good";
  bench.run(60);
  EXPECT_EQ(bench.monitor.reason(), Reason::waiting_for_arm);
  bench.input.bad_frames = 1;  // accepted, but of an arm that is partly hidden
  bench.tick();
  EXPECT_EQ(bench.monitor.reason(), Reason::waiting_for_frames);
  bench.input.bad_frames = 0;
  bench.run(60);
  EXPECT_EQ(bench.monitor.reason(), Reason::waiting_for_arm);
  bench.frames = false;
  bench.run(20);
  EXPECT_EQ(bench.monitor.reason(), Reason::frames_late);
  bench.frames = true;
  bench.run(60);
  EXPECT_EQ(bench.monitor.reason(), Reason::waiting_for_arm);
  bench.input.poses_frozen = true;
  bench.tick();
  EXPECT_EQ(bench.monitor.reason(), Reason::poses_frozen);
}

TEST(CauseTableInCode, TheMoreSevereComeFirst) {
  const auto rules = cause_table();
  EXPECT_EQ(rules[0].reason, Reason::emergency_stop);
  EXPECT_EQ(rules[1].reason, Reason::shutdown);
  for (std::size_t k = 3; k < rules.size(); ++k) {
    EXPECT_LE(rules[k].demands, rules[k - 1].demands) << name(rules[k].reason);
    if (rules[k].demands == rules[k - 1].demands) {
      EXPECT_LE(rules[k].clearance, rules[k - 1].clearance) << name(rules[k].reason);
    }
  }
}

/// docs/reference/faults.md. Of causes that demand and clear the same, the first is reported.
TEST(CauseTableInCode, IsAsDocumented) {
  constexpr std::array kDocumented{
      CauseRule{Reason::emergency_stop, Mode::fault, Clearance::disarm_then_arm},
      CauseRule{Reason::shutdown, Mode::vent, Clearance::never},
      CauseRule{Reason::valves_silent, Mode::fault, Clearance::disarm_then_arm},
      CauseRule{Reason::pressure_mismatch, Mode::fault, Clearance::disarm_then_arm},
      CauseRule{Reason::curvature_mismatch, Mode::fault, Clearance::disarm_then_arm},
      CauseRule{Reason::wrong_model, Mode::fault, Clearance::disarm_then_arm},
      CauseRule{Reason::length_mismatch, Mode::fault, Clearance::disarm_then_arm},
      CauseRule{Reason::disarmed, Mode::vent, Clearance::arm},
      CauseRule{Reason::deadman_released, Mode::vent, Clearance::arm},
      CauseRule{Reason::requests_lost, Mode::vent, Clearance::arm},
      CauseRule{Reason::foreign_commands, Mode::vent, Clearance::arm},
      CauseRule{Reason::soft_limit, Mode::vent, Clearance::arm},
      CauseRule{Reason::activated_too_often, Mode::vent, Clearance::arm},
      CauseRule{Reason::oscillation, Mode::vent, Clearance::arm},
      CauseRule{Reason::contact_vented, Mode::vent, Clearance::arm},
      CauseRule{Reason::valves_silent, Mode::vent, Clearance::good_frames},
      CauseRule{Reason::pressure_mismatch, Mode::vent, Clearance::good_frames},
      CauseRule{Reason::length_mismatch, Mode::vent, Clearance::good_frames},
      CauseRule{Reason::time_gap, Mode::vent, Clearance::good_frames},
      CauseRule{Reason::command_expired, Mode::vent, Clearance::good_frames},
      CauseRule{Reason::sender_restarted, Mode::vent, Clearance::good_frames},
      CauseRule{Reason::frames_stale, Mode::vent, Clearance::good_frames},
      CauseRule{Reason::law_silent, Mode::vent, Clearance::good_frames},
      CauseRule{Reason::frame_period_mismatch, Mode::vent, Clearance::good_frames},
      CauseRule{Reason::many_overruns, Mode::vent, Clearance::good_frames},
      CauseRule{Reason::frames_late, Mode::hold, Clearance::good_frames},
      CauseRule{Reason::law_late, Mode::hold, Clearance::good_frames},
      CauseRule{Reason::poses_frozen, Mode::hold, Clearance::good_frames},
      CauseRule{Reason::contact, Mode::hold, Clearance::good_frames},
      CauseRule{Reason::overruns, Mode::hold, Clearance::good_frames}};
  const auto rules = cause_table();
  ASSERT_EQ(rules.size(), kDocumented.size());
  for (std::size_t k = 0; k < rules.size(); ++k) {
    SCOPED_TRACE(k);
    EXPECT_EQ(rules[k].reason, kDocumented[k].reason) << name(rules[k].reason);
    EXPECT_EQ(rules[k].demands, kDocumented[k].demands) << name(rules[k].reason);
    EXPECT_EQ(rules[k].clearance, kDocumented[k].clearance) << name(rules[k].reason);
  }
}

TEST(CauseTableInCode, AnEmergencyStopIsReportedEvenAfterAnotherFault) {
  Bench bench(Arming::automatic);
  bench.activate();
  bench.input.pressure_mismatch = true;
  ASSERT_EQ(bench.tick(), Mode::fault);
  bench.input.requests.emergency_stop = true;
  EXPECT_EQ(bench.tick(), Mode::fault);
  EXPECT_EQ(bench.monitor.reason(), Reason::emergency_stop);
  bench.input.requests.disarm = bench.input.requests.emergency_stop = true;
  EXPECT_EQ(bench.tick(), Mode::fault) << "of two requests the stop wins";
}

TEST(CauseTableInCode, AnEmergencyStopIsReportedDuringAShutdownAndKept) {
  Bench bench(Arming::automatic);
  bench.activate();
  bench.input.requests.shutdown = true;
  ASSERT_EQ(bench.tick(), Mode::vent);
  bench.input.requests.emergency_stop = true;
  EXPECT_EQ(bench.tick(), Mode::fault);
  EXPECT_EQ(bench.monitor.reason(), Reason::emergency_stop);
  EXPECT_EQ(bench.run(200), Mode::fault);
  bench.input.requests.disarm = true;
  EXPECT_EQ(bench.run(200), Mode::fault) << "too late";
  EXPECT_EQ(bench.monitor.reason(), Reason::emergency_stop);
}

// An `arm` that does not lead to ACTIVE at once.
TEST(PendingArm, IsTakenBackByEveryCauseAndByTime) {
  const auto waiting = [] {
    auto bench = std::make_unique<Bench>(Arming::explicit_);
    bench->run(kGoodFrames / 2);
    bench->input.requests.arm = true;
    EXPECT_EQ(bench->tick(), Mode::wait_frames);
    EXPECT_TRUE(bench->monitor.armed());
    return bench;
  };
  EXPECT_EQ(waiting()->run(kGoodFrames), Mode::active);
  for (const Row& row : rows()) {
    if (row.pressurised || row.clearance == Clearance::never) continue;
    SCOPED_TRACE(name(row.reason));
    const auto bench = waiting();
    // Only what comes later than the run of good frames is awaited.
    if (row.after_ticks > 1) bench->input.bad_frames = 1;
    row.cause(*bench);
    bench->run(row.after_ticks);
    EXPECT_FALSE(bench->monitor.armed());
    bench->input.bad_frames = 0;
    row.remove(*bench);
    EXPECT_NE(bench->run(400), Mode::active);
  }
  const auto bench = waiting();
  bench->input.bad_frames = 1;  // every other frame is refused: no cause, and no run of good ones
  bench->run(1000);
  EXPECT_TRUE(bench->monitor.armed()) << "2 s";
  bench->run(500);
  EXPECT_FALSE(bench->monitor.armed()) << "3 s";
  bench->input.bad_frames = 0;
  EXPECT_NE(bench->run(400), Mode::active);
}

TEST(PendingArm, IsRefusedUnderACauseThatOnlyHolds) {
  Bench bench(Arming::explicit_);
  bench.run(kGoodFrames + 1);
  bench.input.poses_frozen = bench.input.requests.arm = true;
  bench.tick();
  EXPECT_FALSE(bench.monitor.armed());
  bench.input.poses_frozen = false;
  EXPECT_NE(bench.run(400), Mode::active);
}

TEST(PendingArm, InHoldTheArmStaysArmed) {
  Bench bench(Arming::explicit_);
  bench.activate();
  bench.input.poses_frozen = true;
  EXPECT_EQ(bench.run(3000), Mode::hold);
  bench.input.requests.arm = true;
  bench.tick();
  bench.input.poses_frozen = false;
  EXPECT_EQ(bench.run(100), Mode::active);
}

TEST(CauseTableInCode, AFaultIsNotAcknowledgedWhileItLasts) {
  Bench bench(Arming::automatic);
  bench.activate();
  bench.input.pressure_mismatch = true;
  ASSERT_EQ(bench.tick(), Mode::fault);
  bench.input.requests.disarm = true;
  EXPECT_EQ(bench.tick(), Mode::fault) << "there is still pressure";
  bench.run(200);  // vented by now: nothing may have pressure any more, but no sensor confirms it
  bench.input.requests.disarm = true;
  EXPECT_EQ(bench.tick(), Mode::vent);
  bench.run(100);
  EXPECT_EQ(bench.monitor.reason(), Reason::pressure_mismatch);
  bench.input.requests.arm = true;
  EXPECT_EQ(bench.run(100), Mode::vent) << "not armed while pressures do not follow";
}

}  // namespace
}  // namespace softarm
