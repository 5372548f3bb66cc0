// The guard stepped through time by hand: what is written in every cycle, whatever happens.
#include "softarm/valves/valve_guard.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "counted_malloc.hpp"
#include "unit/valves/guard_bench.hpp"

namespace softarm {
namespace {

using test::kMs;
using test::kPeriod;

class Guard : public test::GuardBench {};

TEST_F(Guard, WritesNoPressureBeforeTheTimeoutReadsBack) {
  commanding = true;
  as_written = false;
  for (int k = 0; k < 5000; ++k) {
    ASSERT_NE(cycle(), ValveAction::exchange);
    if (guard->state() == ValveState::disconnected && k > 2) {
      ASSERT_EQ(guard->reason(), ValveReason::failsafe_refused);
    }
  }
  secure_result = LinkResult::exception_reply;
  as_written = true;
  for (int k = 0; k < 5000; ++k) ASSERT_NE(cycle(), ValveAction::exchange);
  secure_result = LinkResult::ok;
  EXPECT_TRUE(reach(ValveState::running));
}

TEST_F(Guard, StartsWithZeroAndRisesGently) {
  commanding = true;
  ASSERT_TRUE(reach(ValveState::running));
  double before = 0.0;
  while (written[1] < 1.0) {
    EXPECT_LE(written[1] - before, settings.rise_bar_per_s * 5e-3 + 1e-12);
    before = written[1];
    cycle();
  }
  // Once there, the slew limit holds; towards zero there is none.
  wanted = {2.0, 0.0};
  before = written[0];
  cycle();
  EXPECT_DOUBLE_EQ(written[1], 0.0);
  EXPECT_DOUBLE_EQ(written[0], before + settings.slew_bar_per_s * 5e-3);
  for (int k = 0; k < 20; ++k) cycle();
  EXPECT_DOUBLE_EQ(written[0], 2.0);
}

TEST_F(Guard, ExpiryVentsInTheSameCycle) {
  run();
  commanding = false;
  int cycles = 0;
  while (written.maxCoeff() > 0.0) {
    ASSERT_LT(++cycles, 100);
    cycle();
  }
  EXPECT_EQ(cycles, 20) << "validity of 100 ms";
  EXPECT_EQ(guard->state(), ValveState::vented);
  EXPECT_EQ(guard->reason(), ValveReason::no_command);
  EXPECT_EQ(guard->sequence(), CommandExpiry::kNoSequence);
}

TEST_F(Guard, ShadowMalformedAndNegativeCommandsNeverPressurise) {
  ASSERT_TRUE(reach(ValveState::vented));
  for (int k = 0; k < 50; ++k) {
    pressures = {1.0, 1.0};
    PressureCommand shadow{.sequence = sequence++,
                           .validity_ns = 100 * kMs,
                           .shadow = true,
                           .pressure_bar = pressures};
    guard->command(shadow, now);
    cycle();
    command(std::nan(""), 1.0);
    cycle();
    ASSERT_TRUE(written.isZero());
    command(-1.0, -2.0);
    cycle();
    ASSERT_TRUE(written.isZero());
  }
}

TEST_F(Guard, PressuresAboveTheLimitAreCut) {
  wanted = {50.0, 1.0};
  commanding = true;
  ASSERT_TRUE(reach(ValveState::running));
  for (int k = 0; k < 200; ++k) cycle();
  EXPECT_DOUBLE_EQ(written[0], 2.0);
}

TEST_F(Guard, AFewLateAnswersAreTolerated) {
  run();
  for (int round = 0; round < 20; ++round) {
    cycle(LinkResult::no_answer);
    cycle(LinkResult::exception_reply);
    EXPECT_EQ(guard->state(), ValveState::running);
    cycle();
    EXPECT_DOUBLE_EQ(written[0], 0.5);
  }
  cycle(LinkResult::no_answer);
  cycle(LinkResult::no_answer);
  cycle(LinkResult::no_answer);
  EXPECT_EQ(guard->state(), ValveState::disconnected);
  EXPECT_EQ(guard->reason(), ValveReason::no_answer);
  EXPECT_TRUE(guard->set_points_bar().isZero());
  EXPECT_TRUE(reach(ValveState::running));
}

TEST_F(Guard, ExceptionRepliesAreAnsweredWithZeroThenWithSilence) {
  run();
  for (int k = 0; k < 3; ++k) cycle(LinkResult::exception_reply);
  EXPECT_EQ(guard->state(), ValveState::degraded);
  EXPECT_EQ(cycle(LinkResult::exception_reply), ValveAction::exchange);
  EXPECT_TRUE(written.isZero()) << "zero is offered for a while";
  expect_silence(LinkResult::exception_reply);
}

// Writes refused, or taken and not carried out: 0.2 s after zero was first wanted nothing is sent
// any more, for longer than the terminal's own time-out, and again after every new attempt.
TEST_F(Guard, ATerminalThatTakesNoZeroIsLeftToVentByItself) {
  for (const bool echo : {true, false}) {
    has_echo = echo;
    for (const bool refuses : {true, false}) {
      SCOPED_TRACE(refuses ? "refuses" : "ignores");
      write_result = LinkResult::ok;
      ignores_writes = false;
      held.setZero();
      commanding = false;
      make();
      run();
      if (refuses) write_result = LinkResult::exception_reply;
      ignores_writes = !refuses;
      if (refuses) {
        for (int k = 0; k < 3; ++k) cycle();
        ASSERT_EQ(guard->state(), ValveState::degraded);
      } else {
        commanding = false;
        for (int k = 0; k < 25 && guard->state() == ValveState::running; ++k) cycle();
        ASSERT_NE(guard->state(), ValveState::running);
      }
      expect_silence(LinkResult::ok);
      commanding = true;
      for (int round = 0; round < 3; ++round) {
        ASSERT_TRUE(reach(ValveState::starting, 5000));
        expect_silence(LinkResult::ok);
      }
      EXPECT_FALSE(guard->zero_confirmed());
      held.setZero();  // its time-out
      write_result = LinkResult::ok;
      ignores_writes = false;
      ASSERT_TRUE(reach(ValveState::vented, 5000));
      for (int k = 0; k < 100; ++k) cycle();
      EXPECT_EQ(guard->reason(), ValveReason::waiting_for_zero) << "somebody has to look first";
    }
  }
}

// An arm that empties slowly is not taken for one that does not.
TEST_F(Guard, PressureThatHalvesWithinTheTerminalsTimeOutIsOnItsWay) {
  run();
  commanding = false;
  while (written.maxCoeff() > 0.0) cycle();
  for (stuck_at = 0.5; stuck_at > 0.1; stuck_at *= 0.98) {
    cycle();
    ASSERT_EQ(guard->state(), ValveState::vented) << stuck_at;
    EXPECT_FALSE(guard->zero_confirmed());
  }
  cycle();
  EXPECT_TRUE(guard->zero_confirmed());
  for (stuck_at = 0.11; guard->state() == ValveState::vented; stuck_at *= 0.999) cycle();
  EXPECT_EQ(guard->reason(), ValveReason::zero_unconfirmed);
}

TEST_F(Guard, SetPointsThatAreNotThoseWrittenDegradeAtOnce) {
  run();
  held[1] -= 0.002;  // another master, or a write that was lost
  cycle();
  EXPECT_TRUE(written.isZero());
  EXPECT_EQ(guard->reason(), ValveReason::echo_mismatch);
  EXPECT_EQ(guard->chamber(), 1);
  EXPECT_TRUE(reach(ValveState::running));
}

// A pause that no clock counts: the terminal has vented, and its pressures are read first.
TEST_F(Guard, ATerminalThatVentedWhileNobodyCountedIsNotFilledAgain) {
  for (const bool echo : {true, false}) {
    has_echo = echo;
    make();
    run();
    held.setZero();
    cycle();
    EXPECT_TRUE(written.isZero());
    EXPECT_EQ(guard->state(), ValveState::degraded);
    EXPECT_EQ(guard->reason(), echo ? ValveReason::echo_mismatch : ValveReason::time_gap);
    held.setZero();
  }
}

TEST_F(Guard, AWriteWithoutAnAnswerMayHaveArrivedOrNot) {
  run();
  for (const bool arrived : {true, false}) {
    wanted[0] += 0.05;
    write_result = LinkResult::no_answer;
    cycle();
    if (arrived) held = written;
    write_result = LinkResult::ok;
    cycle();
    EXPECT_EQ(guard->state(), ValveState::running) << arrived;
  }
}

TEST_F(Guard, NoPressureIsWrittenWithoutAReadBackBeforeIt) {
  run();
  const Eigen::VectorXd before = written;
  wanted[0] = 0.6;
  cycle(LinkResult::no_answer);
  EXPECT_EQ(written, before);
  EXPECT_FALSE(guard->may_write());
}

TEST_F(Guard, APauseOfTheClockIsAGapAndEndsTheCommandInForce) {
  run();
  now += kPeriod;
  EXPECT_FALSE(guard->wake(now, true));
  EXPECT_EQ(guard->reason(), ValveReason::time_gap);
  commanding = false;
  cycle();
  EXPECT_TRUE(written.isZero());
  ASSERT_TRUE(reach(ValveState::vented));
  for (int k = 0; k < 50; ++k) cycle();
  EXPECT_EQ(guard->reason(), ValveReason::no_command);
}

TEST_F(Guard, ATimeOutThatAnotherMasterChangedIsFoundWithinASecondAndSetAgain) {
  run();
  for (int k = 0; k < 1000; ++k) cycle();
  EXPECT_NEAR(failsafe_checks, 5, 2) << "once a second";
  failsafe_is_set = false;
  int cycles = 0;
  while (guard->state() == ValveState::running) {
    ASSERT_LT(++cycles, 202);
    cycle();
  }
  EXPECT_EQ(guard->reason(), ValveReason::failsafe_changed);
  EXPECT_TRUE(written.isZero()) << "in the same cycle";
  cycle();
  EXPECT_TRUE(failsafe_is_set);
  ASSERT_TRUE(reach(ValveState::running));
  takes_failsafe = false;
  failsafe_is_set = false;
  for (int k = 0; k < 205; ++k) cycle();
  EXPECT_EQ(guard->state(), ValveState::disconnected);
  EXPECT_EQ(guard->reason(), ValveReason::failsafe_refused);
}

TEST_F(Guard, ASecondSenderVentsUntilOneHasLeftAndCommandsHaveBeenZero) {
  run();
  const auto intrude = [&](std::int64_t number) {
    const std::array<double, 2> theirs{2.0, 2.0};
    guard->command({.sequence = number, .validity_ns = 100 * kMs, .pressure_bar = theirs}, now);
  };
  const double before = written.maxCoeff();
  intrude(sequence + 1'000'000);
  now += kPeriod;
  guard->wake(now);
  ASSERT_EQ(guard->next(now), ValveAction::exchange);
  exchange(LinkResult::ok);
  EXPECT_LE(written.maxCoeff(), before + settings.slew_bar_per_s * 10e-3) << "one cycle at most";
  cycle();  // with the next command of the first sender
  EXPECT_EQ(guard->state(), ValveState::degraded);
  EXPECT_EQ(guard->reason(), ValveReason::other_sender);
  EXPECT_TRUE(written.isZero());
  for (int k = 0; k < 200; ++k) {
    intrude(sequence + 1'000'000 + k);
    cycle();
    ASSERT_TRUE(written.isZero()) << k;
  }
  EXPECT_GT(guard->counters().other_senders, 200);
  ASSERT_TRUE(reach(ValveState::vented));
  for (int k = 0; k < 200; ++k) cycle();
  EXPECT_EQ(guard->reason(), ValveReason::waiting_for_zero);
  wanted = {0.0, 0.0};
  cycle();
  wanted = {0.5, 1.0};
  EXPECT_TRUE(reach(ValveState::running));
}

TEST_F(Guard, AFloodOfAnotherSenderDoesNotHideThatTheTerminalIsReady) {
  commanding = true;
  const auto flood = [&] {
    const std::array<double, 2> theirs{2.0, 2.0};
    for (int k = 0; k < 50; ++k)
      guard->command(
          {.sequence = sequence + 1'000'000 + k, .validity_ns = 100 * kMs, .pressure_bar = theirs},
          now);
  };
  for (int k = 0; k < 20; ++k) {
    cycle();
    flood();
    ASSERT_TRUE(written.isZero()) << k;
  }
  EXPECT_EQ(guard->state(), ValveState::degraded);
  EXPECT_EQ(guard->reason(), ValveReason::other_sender);
  EXPECT_EQ(guard->counters().times_degraded, 1);
  wanted = {0.0, 0.0};
  EXPECT_TRUE(reach(ValveState::running, 150));
}

TEST_F(Guard, AnotherSenderDoesNotExcuseAStuckValve) {
  run();
  stuck_at = 2.0;
  ASSERT_TRUE(reach(ValveState::degraded));
  ASSERT_EQ(guard->reason(), ValveReason::stuck_valve);
  const std::array<double, 2> theirs{2.0, 2.0};
  command(0.5, 1.0);
  guard->command(
      {.sequence = sequence + 1'000'000, .validity_ns = 100 * kMs, .pressure_bar = theirs}, now);
  command(0.5, 1.0);
  EXPECT_GT(guard->counters().other_senders, 0);
  EXPECT_EQ(guard->reason(), ValveReason::stuck_valve);
}

TEST_F(Guard, AnEmergencyStopVentsUntilItIsAcknowledgedWhateverElseHappens) {
  run();
  guard->emergency_stop();
  EXPECT_EQ(guard->state(), ValveState::degraded);
  EXPECT_EQ(guard->reason(), ValveReason::emergency_stop);
  EXPECT_TRUE(guard->set_points_bar().isZero()) << "at once";
  for (int k = 0; k < 500; ++k) {
    read_back.diagnosis[0] = k % 100 == 50;  // another fault that comes and goes
    cycle();
    ASSERT_TRUE(written.isZero()) << k;
    ASSERT_EQ(guard->reason(), ValveReason::emergency_stop);
    ASSERT_EQ(guard->chamber(), -1);
  }
  guard->acknowledge();
  ASSERT_TRUE(reach(ValveState::vented));
  for (int k = 0; k < 100; ++k) cycle();
  EXPECT_EQ(guard->reason(), ValveReason::waiting_for_zero) << "with automatic arming too";
  wanted = {0.0, 0.0};
  cycle();
  wanted = {0.5, 1.0};
  EXPECT_TRUE(reach(ValveState::running));
}

TEST_F(Guard, AnEmergencyStopBeforeTheConnectionOrWithoutCommandsIsKept) {
  for (const ValveState state :
       {ValveState::disconnected, ValveState::securing, ValveState::starting, ValveState::vented}) {
    make();
    commanding = false;
    ASSERT_TRUE(reach(state));
    guard->emergency_stop();
    commanding = true;
    ASSERT_TRUE(reach(ValveState::degraded)) << name(state);
    EXPECT_EQ(guard->reason(), ValveReason::emergency_stop);
    reachable = false;  // the connection is lost and comes back
    cycle(LinkResult::broken);
    ASSERT_EQ(guard->state(), ValveState::disconnected);
    reachable = true;
    ASSERT_TRUE(reach(ValveState::degraded));
    for (int k = 0; k < 200; ++k) cycle();
    EXPECT_EQ(guard->state(), ValveState::degraded);
    EXPECT_EQ(guard->reason(), ValveReason::emergency_stop);
  }
}

TEST_F(Guard, WithExplicitArmingPressureDoesNotReturnByItselfAfterAnExpiry) {
  settings.wait_for_zero = true;
  make();
  commanding = true;
  wanted = {0.0, 0.0};
  ASSERT_TRUE(reach(ValveState::running));
  wanted = {0.5, 1.0};
  for (int k = 0; k < 100; ++k) cycle();
  ASSERT_DOUBLE_EQ(written[1], 1.0);
  commanding = false;  // lost on the way
  for (int k = 0; k < 100; ++k) cycle();
  EXPECT_EQ(guard->counters().times_vented, 1);
  commanding = true;
  for (int k = 0; k < 100; ++k) {
    cycle();
    ASSERT_TRUE(written.isZero()) << "silence of the network is no zero of the sender";
  }
  wanted = {0.0, 0.0};
  cycle();
  EXPECT_TRUE(reach(ValveState::running));
}

TEST_F(Guard, ABrokenConnectionIsTriedAgainWithGrowingPauses) {
  run();
  cycle(LinkResult::broken);
  EXPECT_EQ(guard->state(), ValveState::disconnected);
  reachable = false;
  std::int64_t last = now;
  std::vector<std::int64_t> pauses;
  while (pauses.size() < 9) {
    if (cycle() == ValveAction::connect) {
      pauses.push_back(now - last);
      last = now;
    }
  }
  // The terminal's time-out is 0.2 s: in every pause it vents.
  EXPECT_NEAR(static_cast<double>(pauses[0]), 320.0 * kMs, kPeriod);
  EXPECT_NEAR(static_cast<double>(pauses[1]), 640.0 * kMs, kPeriod);
  EXPECT_NEAR(static_cast<double>(pauses[2]), 1280.0 * kMs, kPeriod);
  EXPECT_NEAR(static_cast<double>(pauses[8]), 5000.0 * kMs, kPeriod) << "no longer than that";
  reachable = true;
  EXPECT_TRUE(reach(ValveState::running));
  EXPECT_EQ(guard->counters().connections, 2);
}

TEST_F(Guard, AStuckValveIsFoundAndStaysVentedUntilSomeoneLooked) {
  run();
  stuck_at = 0.0;
  int cycles = 0;
  while (guard->state() == ValveState::running) {
    ASSERT_LT(++cycles, 400);
    cycle();
  }
  EXPECT_NEAR(cycles, 202, 2) << "1 s";
  EXPECT_EQ(guard->reason(), ValveReason::stuck_valve);
  EXPECT_EQ(guard->chamber(), 0);
  stuck_at = -1.0;
  ASSERT_TRUE(reach(ValveState::vented));
  for (int k = 0; k < 1000; ++k) cycle();
  EXPECT_EQ(guard->reason(), ValveReason::waiting_for_zero);
  wanted = {0.0, 0.0};
  cycle();
  wanted = {0.5, 1.0};
  EXPECT_TRUE(reach(ValveState::running));
}

TEST_F(Guard, AValveThatDoesNotCloseNeverGetsPressureAgain) {
  run();
  stuck_at = 1.7;
  ASSERT_TRUE(reach(ValveState::degraded));
  for (int k = 0; k < 2000; ++k) {
    cycle();
    ASSERT_NE(guard->state(), ValveState::vented);
    ASSERT_NE(guard->state(), ValveState::running);
  }
}

TEST_F(Guard, AStuckValveMayBeReportedOnly) {
  settings.driver.stuck_vents = false;
  make();
  run();
  stuck_at = 0.0;
  for (int k = 0; k < 300; ++k) cycle();
  EXPECT_EQ(guard->state(), ValveState::running);
  EXPECT_EQ(guard->chamber(), 0);
}

TEST_F(Guard, ADiagnosisVentsAtOnceUntilItHasBeenAwayForAWhile) {
  run();
  read_back.diagnosis[1] = 4;
  cycle();
  EXPECT_EQ(guard->state(), ValveState::degraded);
  EXPECT_EQ(guard->reason(), ValveReason::diagnosis);
  EXPECT_EQ(guard->chamber(), 1);
  cycle();
  EXPECT_TRUE(written.isZero());
  read_back.diagnosis[1] = 0;
  int cycles = 0;
  while (guard->state() == ValveState::degraded) {
    ++cycles;
    cycle();
  }
  EXPECT_EQ(cycles, 50);
  EXPECT_TRUE(reach(ValveState::running));
}

TEST_F(Guard, ATerminalThatIsNotReadyIsWaitedForAndGivenUp) {
  read_back.ready = false;
  commanding = true;
  ASSERT_TRUE(reach(ValveState::starting));
  for (int k = 0; k < 3000; ++k) {
    cycle();
    ASSERT_EQ(guard->state(), ValveState::starting);
  }
  EXPECT_TRUE(reach(ValveState::disconnected));
  EXPECT_EQ(guard->reason(), ValveReason::not_ready);
}

// Of a terminal that now and then does not answer, the starting takes as long as of any other.
TEST_F(Guard, FailuresDoNotProlongTheWaitForATerminalThatIsNotReady) {
  for (const LinkResult result : {LinkResult::no_answer, LinkResult::exception_reply}) {
    make();
    read_back.ready = false;
    ASSERT_TRUE(reach(ValveState::starting));
    const std::int64_t since = now;
    for (int k = 0; k < 5000 && guard->state() == ValveState::starting; ++k)
      cycle(k % 50 == 0 ? result : LinkResult::ok);
    EXPECT_EQ(guard->state(), ValveState::disconnected);
    EXPECT_EQ(guard->reason(), ValveReason::not_ready);
    EXPECT_NEAR(static_cast<double>(now - since), 20'000.0 * kMs, 2 * kPeriod);
  }
}

// Nor do failures of one kind that begin before the terminal is secured shorten it.
TEST_F(Guard, FailuresWhileSecuringAreForgottenOnceItIsSecured) {
  secure_result = LinkResult::no_answer;
  ASSERT_TRUE(reach(ValveState::securing));
  for (int k = 0; k < settings.driver.tolerated_failures; ++k) cycle();
  ASSERT_EQ(guard->state(), ValveState::securing);
  secure_result = LinkResult::ok;
  cycle();
  ASSERT_EQ(guard->state(), ValveState::starting);
  for (int k = 0; k < settings.driver.tolerated_failures; ++k) {
    cycle(LinkResult::no_answer);
    EXPECT_EQ(guard->state(), ValveState::starting) << k;
  }
}

TEST_F(Guard, AGapInTimeDegrades) {
  run();
  now += 300 * kMs;
  EXPECT_FALSE(guard->wake(now)) << "what waits in queues is too old";
  EXPECT_EQ(guard->state(), ValveState::degraded);
  EXPECT_EQ(guard->reason(), ValveReason::time_gap);
  cycle();
  EXPECT_TRUE(written.isZero());
  EXPECT_TRUE(reach(ValveState::running));
  EXPECT_EQ(guard->counters().times_degraded, 1);
}

// Five periods, but not less than 50 ms, nor more than the terminal's time-out.
TEST_F(Guard, AGapBeginsBeyondItsThreshold) {
  struct Row {
    double rate_hz, failsafe_s;
    std::int64_t longest_ns;
  };
  for (const Row& row :
       {Row{200.0, 0.2, 50 * kMs}, {20.0, 0.4, 250 * kMs}, {20.0, 0.2, 199 * kMs}}) {
    settings.driver.rate_hz = row.rate_hz;
    settings.driver.failsafe_timeout_s = row.failsafe_s;
    for (const bool beyond : {false, true}) {
      make();
      run();
      now += row.longest_ns + (beyond ? 1 * kMs : 0);
      // Beyond the time-out of 0.2 s nothing has been answered for too long as well.
      EXPECT_EQ(guard->wake(now), !beyond) << row.rate_hz << " Hz, " << row.failsafe_s << " s";
    }
  }
}

// It was our silence, in which the terminal has vented, and not pressure that does not fall.
TEST_F(Guard, AfterASleepAsLongAsTheTerminalsTimeOutPressureHasItAgainToFall) {
  settings.driver.failsafe_timeout_s = 0.2;
  make();
  run();
  now += 200 * kMs;
  EXPECT_FALSE(guard->wake(now));
  EXPECT_EQ(guard->next(now), ValveAction::exchange);
  EXPECT_EQ(guard->state(), ValveState::degraded);
}

TEST_F(Guard, WithoutAConnectionCommandsAreHeardAllTheSame) {
  run();
  reachable = false;
  cycle(LinkResult::broken);
  for (int k = 0; k < 100; ++k) {
    now += kPeriod;
    ASSERT_TRUE(guard->wake(now)) << k;
    guard->next(now);
  }
}

TEST_F(Guard, SilenceOfTheCommanderIsAsGoodAsZeroAfterDegraded) {
  for (const bool waits : {false, true}) {
    settings.wait_for_zero = waits;
    make();
    commanding = true;
    wanted = {0.0, 0.0};
    ASSERT_TRUE(reach(ValveState::running));
    wanted = {0.5, 1.0};
    command(0.5, 1.0);
    const std::array<double, 2> theirs{2.0, 2.0};
    guard->command(
        {.sequence = sequence + 1'000'000, .validity_ns = 100 * kMs, .pressure_bar = theirs}, now);
    cycle();
    ASSERT_EQ(guard->state(), ValveState::degraded);
    commanding = false;
    for (int k = 0; k < 200; ++k) cycle();
    ASSERT_EQ(guard->state(), ValveState::vented);
    commanding = true;
    cycle();
    EXPECT_EQ(guard->state(), ValveState::running);
  }
}

TEST_F(Guard, AConnectionThatIsLostWhileVentedNeedsNoZero) {
  settings.wait_for_zero = true;
  make();
  commanding = true;
  wanted = {0.0, 0.0};
  ASSERT_TRUE(reach(ValveState::running));
  commanding = false;
  ASSERT_TRUE(reach(ValveState::vented));
  cycle(LinkResult::broken);
  ASSERT_EQ(guard->state(), ValveState::disconnected);
  wanted = {0.5, 1.0};
  commanding = true;
  EXPECT_TRUE(reach(ValveState::running));
}

// While the driver is held up it hears nothing: that is not a silence of the commander.
TEST_F(Guard, WithExplicitArmingWhatWeCouldNotHearIsNoSilence) {
  settings.wait_for_zero = true;
  make();
  commanding = true;
  wanted = {0.0, 0.0};
  ASSERT_TRUE(reach(ValveState::running));
  wanted = {0.5, 1.0};
  for (int k = 0; k < 100; ++k) cycle();
  now += 300 * kMs;
  commanding = false;  // none comes in the cycle after the gap
  cycle();
  commanding = true;
  for (int k = 0; k < 300; ++k) {
    cycle();
    ASSERT_NE(guard->state(), ValveState::running) << k;
  }
  EXPECT_EQ(guard->reason(), ValveReason::waiting_for_zero);
  wanted = {0.0, 0.0};
  cycle();
  EXPECT_TRUE(reach(ValveState::running));
}

// What is a gap depends on the terminal: it may have vented already.
TEST_F(Guard, NoGapIsLongerThanTheTerminalsOwnTimeOut) {
  settings.driver.failsafe_timeout_s = 0.02;
  make();
  run();
  now += 16 * kMs;
  cycle();
  EXPECT_EQ(guard->state(), ValveState::degraded);
  EXPECT_TRUE(written.isZero());
}

TEST_F(Guard, WhereNoAnswerCameForTheTerminalsTimeOutItHasVented) {
  settings.driver.tolerated_failures = 100;
  settings.driver.failsafe_timeout_s = 0.2;
  make();
  run();
  for (int k = 0; k < 39; ++k) cycle(LinkResult::no_answer);
  ASSERT_EQ(guard->state(), ValveState::running);
  cycle();
  EXPECT_EQ(guard->state(), ValveState::degraded);
  EXPECT_EQ(guard->reason(), ValveReason::time_gap);
}

TEST_F(Guard, WhatWasDecidedBeforeAGapIsNotWrittenAfterIt) {
  run();
  ASSERT_EQ(guard->next(now), ValveAction::exchange);
  ASSERT_GT(guard->set_points_bar().minCoeff(), 0.0);
  guard->wake(now += 300 * kMs);
  EXPECT_TRUE(guard->set_points_bar().isZero());
  EXPECT_EQ(guard->reason(), ValveReason::time_gap);
}

TEST_F(Guard, WithExplicitArmingCommandsMustHaveBeenZeroAfterDegraded) {
  settings.wait_for_zero = true;
  make();
  commanding = true;
  ASSERT_TRUE(reach(ValveState::vented));
  for (int k = 0; k < 200; ++k) cycle();
  EXPECT_EQ(guard->reason(), ValveReason::waiting_for_zero);
  wanted = {0.0, 0.0};
  cycle();
  wanted = {0.5, 1.0};
  run();
  cycle(LinkResult::broken);
  ASSERT_TRUE(reach(ValveState::vented));
  for (int k = 0; k < 200; ++k) cycle();
  EXPECT_EQ(guard->reason(), ValveReason::waiting_for_zero);
  commanding = false;  // silence is as good as zero
  for (int k = 0; k < 30; ++k) cycle();
  commanding = true;
  EXPECT_TRUE(reach(ValveState::running));
}

TEST_F(Guard, AStopIsZeroAndConfirmed) {
  run();
  EXPECT_FALSE(guard->zero_confirmed());
  guard->stop();
  EXPECT_TRUE(guard->set_points_bar().isZero());
  EXPECT_FALSE(guard->zero_confirmed()) << "not yet written";
  cycle(LinkResult::no_answer);
  EXPECT_FALSE(guard->zero_confirmed());
  cycle();
  EXPECT_TRUE(written.isZero());
  EXPECT_FALSE(guard->zero_confirmed()) << "not yet measured";
  cycle();
  EXPECT_TRUE(guard->zero_confirmed());
  EXPECT_EQ(guard->reason(), ValveReason::shutdown);
}

TEST_F(Guard, AStopIsNotConfirmedBeforeMeasuredPressureHasFallen) {
  run();
  guard->stop();
  stuck_at = 0.5;
  for (int k = 0; k < 10; ++k) cycle();
  EXPECT_TRUE(written.isZero());
  EXPECT_FALSE(guard->zero_confirmed());
  stuck_at = 0.05;
  cycle();
  EXPECT_TRUE(guard->zero_confirmed());
  held[0] = 0.5;  // as the terminal has it
  cycle();
  EXPECT_FALSE(guard->zero_confirmed());
}

TEST_F(Guard, WithoutAConnectionThereIsNothingToConfirmUnlessPressureWasWritten) {
  EXPECT_TRUE(guard->zero_confirmed());
  run();
  cycle(LinkResult::broken);
  guard->stop();
  EXPECT_FALSE(guard->zero_confirmed());
  EXPECT_EQ(cycle(), ValveAction::wait) << "no new connection on the way out";
}

/// Any sequence of failures, commands and read-back: pressures in range, zero unless running.
TEST_F(Guard, NeverPressurisesOutsideRunning) {
  std::uint32_t state = 1;
  const auto random = [&](std::uint32_t n) {
    state = state * 1664525U + 1013904223U;
    return (state >> 16) % n;
  };
  int ran = 0;
  for (int k = 0; k < 200000; ++k) {
    commanding = random(10) < 8;
    wanted = {0.25 * random(16) - 1.0, 0.25 * random(16) - 1.0};
    reachable = random(4) > 0;
    as_written = random(4) > 0;
    stuck_at = random(40) == 0 ? 1.5 : -1.0;
    read_back.diagnosis[1] = random(300) == 0 ? 1 : 0;
    if (random(500) == 0) now += 100 * kMs;
    const auto dice = random(200);
    cycle(dice == 0  ? LinkResult::broken
          : dice < 4 ? LinkResult::no_answer
          : dice < 8 ? LinkResult::exception_reply
                     : LinkResult::ok);  // expectations stand in `cycle`
    if (HasFailure()) return;
    ran += guard->state() == ValveState::running;
  }
  EXPECT_GT(ran, 10000) << "or nothing was tested";
}

TEST_F(Guard, AllocatesNothing) {
  run();
  const long before = test::allocations;
  for (int k = 0; k < 100; ++k) {
    now += kPeriod;
    guard->wake(now);
    guard->next(now);
    const LinkResult result = k % 7 == 0 ? LinkResult::no_answer : LinkResult::ok;
    guard->measured(result, read_back, now);
    if (guard->failsafe_due(now)) guard->failsafe_checked(LinkResult::ok, true, now);
    guard->written(result, now);
  }
  EXPECT_EQ(test::allocations - before, 0);
}

}  // namespace
}  // namespace softarm
