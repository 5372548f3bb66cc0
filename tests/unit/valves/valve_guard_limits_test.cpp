// Every threshold and count of the guard, at it and beyond it.
#include <gtest/gtest.h>

#include <array>

#include "unit/valves/guard_bench.hpp"

namespace softarm {
namespace {

using test::kMs;
using test::kPeriod;

class GuardLimits : public test::GuardBench {
 protected:
  void intrude() {
    const std::array<double, 2> theirs{2.0, 2.0};
    guard->command(
        {.sequence = sequence + 1'000'000, .validity_ns = 100 * kMs, .pressure_bar = theirs}, now);
  }
  int cycles_to(ValveState state, int limit = 2000) {
    int cycles = 0;
    while (guard->state() != state && cycles < limit) {
      cycle();
      ++cycles;
    }
    return cycles;
  }
  /// Reads back what is in `read_back`, in the middle of a cycle.
  void measure() {
    now += kPeriod;
    guard->wake(now);
    command(wanted[0], wanted[1]);
    ASSERT_EQ(guard->next(now), ValveAction::exchange);
    guard->measured(LinkResult::ok, read_back, now);
  }
};

TEST_F(GuardLimits, BeforeAConnectionNothingIsKnown) {
  EXPECT_FALSE(guard->may_read());
  EXPECT_FALSE(guard->failsafe_lost());
  EXPECT_TRUE(guard->zero_confirmed()) << "no terminal was ever reached";
  cycles_to(ValveState::securing);
  EXPECT_FALSE(guard->zero_confirmed()) << "its pressures are not known";
  cycles_to(ValveState::starting);
  EXPECT_FALSE(guard->may_read()) << "nothing has been written yet";
  EXPECT_FALSE(guard->failsafe_lost());
  cycle();
  EXPECT_TRUE(guard->may_read());
}

// One to write the first zero, then three with a read-back.
TEST_F(GuardLimits, ThreeGoodCyclesEndTheStart) {
  cycles_to(ValveState::starting);
  EXPECT_EQ(cycles_to(ValveState::vented), 4);
}

TEST_F(GuardLimits, AQuarterOfASecondIsGoodEnough) {
  run();
  guard->emergency_stop();
  cycle();  // zero is written
  guard->acknowledge();
  EXPECT_EQ(cycles_to(ValveState::vented), 50);
}

TEST_F(GuardLimits, PressureAtItsBoundsIsVentedAndHalfIsHalf) {
  settings.driver.vented_bar = 0.125;
  make();
  run();
  guard->emergency_stop();
  stuck_at = 0.125;
  for (int k = 0; k < 200; ++k) cycle();
  EXPECT_EQ(guard->state(), ValveState::degraded);
  EXPECT_TRUE(guard->zero_confirmed());
  stuck_at = 0.126;
  cycle();
  EXPECT_FALSE(guard->zero_confirmed());

  settings.driver.vented_bar = 0.01;
  stuck_at = -1.0;
  wanted = {1.0, 1.0};
  make();
  run();
  guard->emergency_stop();
  for (stuck_at = 1.0; stuck_at > 0.02; stuck_at *= 0.5)
    for (int k = 0; k < 38; ++k) {
      cycle();
      ASSERT_EQ(guard->state(), ValveState::degraded) << stuck_at;
    }
}

TEST_F(GuardLimits, PressureThatDoesNotFallHasOneTimeOut) {
  settings.driver.failsafe_timeout_s = 0.2;
  make();
  run();
  stuck_at = 1.0;
  guard->emergency_stop();
  EXPECT_EQ(cycles_to(ValveState::disconnected), 40);
}

TEST_F(GuardLimits, TheNextAttemptComesWhenTheBackOffIsOver) {
  settings.driver.backoff_s = 1.0;
  make();
  reachable = false;
  cycle();
  const std::int64_t failed_ns = now;
  guard->wake(failed_ns + 1000 * kMs - 1);
  EXPECT_EQ(guard->next(failed_ns + 1000 * kMs - 1), ValveAction::wait);
  EXPECT_EQ(guard->next(failed_ns + 1000 * kMs), ValveAction::connect);
}

TEST_F(GuardLimits, AnEchoMayBeOffByItsResolution) {
  run();
  for (const double side : {-1.0, 1.0}) {
    for (const int chamber : {0, 1}) {
      for (const bool beyond : {false, true}) {
        make();
        run();
        read_back = ReadBack(2);
        read_back.has_echo = true;
        read_back.resolution_bar = 0.25;
        read_back.actual_bar = read_back.echo_bar = held;
        read_back.echo_bar[chamber] += side * (beyond ? 0.25 + 1e-9 : 0.25);
        measure();
        EXPECT_EQ(guard->state(), beyond ? ValveState::degraded : ValveState::running)
            << side << " " << chamber;
        read_back = ReadBack(2);
      }
    }
  }
}

TEST_F(GuardLimits, AnEchoOfZeroMayBeOffByItsResolution) {
  run();
  guard->emergency_stop();
  for (int k = 0; k < 3; ++k) cycle();
  read_back.resolution_bar = 0.25;
  read_back.echo_bar[1] = 0.25;
  measure();
  EXPECT_TRUE(guard->zero_confirmed());
  read_back.echo_bar[1] = -0.25;
  measure();
  EXPECT_TRUE(guard->zero_confirmed());
  read_back.echo_bar[1] = 0.26;
  measure();
  EXPECT_FALSE(guard->zero_confirmed());
}

TEST_F(GuardLimits, WithoutAnEchoAPressureThatFallsByMoreThanABoundIsAGap) {
  has_echo = false;
  wanted = {1.0, 1.0};
  settings.driver.stuck_bar = 0.25;
  for (const int chamber : {0, 1}) {
    for (const bool beyond : {false, true}) {
      make();
      run();
      read_back.actual_bar = held;
      read_back.actual_bar[chamber] -= beyond ? 0.25 + 1e-9 : 0.25;
      measure();
      EXPECT_EQ(guard->state(), beyond ? ValveState::degraded : ValveState::running) << chamber;
      if (beyond) {
        EXPECT_EQ(guard->reason(), ValveReason::time_gap);
      }
    }
  }
  // One that has never been higher has not fallen.
  make();
  run();
  stuck_at = 0.5;
  cycle();
  EXPECT_EQ(guard->state(), ValveState::degraded) << "that was a fall";
  // Nor one that was not measured in the cycle before: in two it may have.
  stuck_at = -1.0;
  make();
  run();
  cycle(LinkResult::no_answer);
  stuck_at = 0.0;
  cycle();
  EXPECT_EQ(guard->state(), ValveState::running);
  stuck_at = -1.0;
  make();
  commanding = true;
  while (guard->state() != ValveState::running) cycle();
  stuck_at = 0.0;  // it lags behind what is written
  for (int k = 0; k < 100; ++k) {
    cycle();
    ASSERT_EQ(guard->state(), ValveState::running) << k;
  }
}

// A check of the time-out that got no answer is tolerated, but the cycle writes no pressure.
TEST_F(GuardLimits, NoPressureIsWrittenWhereTheTimeOutIsNotKnown) {
  make();
  run();
  for (int k = 0; k < 1000 && !guard->failsafe_due(now); ++k) {
    measure();
    if (!guard->failsafe_due(now)) guard->written(LinkResult::ok, now);
  }
  ASSERT_TRUE(guard->failsafe_due(now));
  EXPECT_TRUE(guard->may_write());
  guard->failsafe_checked(LinkResult::no_answer, false, now);
  EXPECT_EQ(guard->state(), ValveState::running);
  EXPECT_FALSE(guard->may_write());
}

TEST_F(GuardLimits, OnlyACommandThatIsWrittenHasANumber) {
  make();
  run();
  EXPECT_EQ(guard->sequence(), sequence - 1);
  guard->emergency_stop();
  cycle();
  EXPECT_EQ(guard->commands().sequence(), sequence - 1) << "it is in force";
  EXPECT_EQ(guard->sequence(), CommandExpiry::kNoSequence);
}

TEST_F(GuardLimits, AValveIsStuckBeyondItsBoundForLongerThanItsTime) {
  settings.driver.stuck_bar = 0.25;
  settings.driver.stuck_after_s = 0.1;
  make();
  run();
  stuck_at = 0.25;  // set to 0.5
  for (int k = 0; k < 100; ++k) cycle();
  EXPECT_EQ(guard->state(), ValveState::running) << "at its bound";
  stuck_at = 0.24;
  cycle();  // off since now
  for (int k = 0; k < 20; ++k) cycle();
  EXPECT_EQ(guard->state(), ValveState::running) << "for 0.1 s";
  cycle();
  EXPECT_EQ(guard->reason(), ValveReason::stuck_valve);
}

TEST_F(GuardLimits, OfTwoStuckValvesTheFirstIsNamed) {
  run();
  stuck_at = 2.0;
  settings.driver.stuck_after_s = 0.1;
  make();
  stuck_at = -1.0;
  run();
  read_back = ReadBack(2);
  for (int k = 0; k < 30 && guard->state() == ValveState::running; ++k) {
    read_back.has_echo = true;
    read_back.echo_bar = held;
    read_back.actual_bar.setConstant(2.0);
    measure();
    written = guard->set_points_bar();
    guard->written(LinkResult::ok, now);
    held = written;
  }
  EXPECT_EQ(guard->reason(), ValveReason::stuck_valve);
  EXPECT_EQ(guard->chamber(), 0);
}

// Off again before it counts as stuck, but not to be relied on.
TEST_F(GuardLimits, AStuckValveThatFollowsNowAndThenStaysVented) {
  settings.driver.stuck_bar = 0.05;
  settings.driver.stuck_after_s = 0.5;
  make();
  run();
  stuck_at = 2.0;
  ASSERT_GT(cycles_to(ValveState::degraded), 0);
  ASSERT_EQ(guard->reason(), ValveReason::stuck_valve);
  for (int k = 0; k < 1000; ++k) {
    stuck_at = k % 80 == 0 ? 0.0 : 0.08;  // vented, but off by more than its bound
    cycle();
    ASSERT_EQ(guard->state(), ValveState::degraded) << k;
  }
}

TEST_F(GuardLimits, ATerminalHasTwentySecondsToGetReady) {
  read_back.ready = false;
  cycles_to(ValveState::starting);
  const std::int64_t secured_ns = now;
  while (now < secured_ns + 20'000 * kMs) cycle();
  EXPECT_EQ(now, secured_ns + 20'000 * kMs);
  EXPECT_EQ(guard->state(), ValveState::starting);
  cycle();
  EXPECT_EQ(guard->state(), ValveState::disconnected);
  EXPECT_EQ(guard->reason(), ValveReason::not_ready);
}

TEST_F(GuardLimits, TheTimeOutIsReadBackOnceASecondWhereTheTerminalAnswers) {
  cycles_to(ValveState::starting);
  const std::int64_t secured_ns = now;
  while (now < secured_ns + 995 * kMs) cycle();
  EXPECT_EQ(failsafe_checks, 0);
  cycle();
  EXPECT_EQ(failsafe_checks, 1);
  while (now < secured_ns + 10'000 * kMs) cycle();
  EXPECT_EQ(failsafe_checks, 10);
  while (now < secured_ns + 10'995 * kMs) cycle();
  cycle(LinkResult::no_answer);
  EXPECT_EQ(failsafe_checks, 10) << "not where nothing was read";
  cycle();
  EXPECT_EQ(failsafe_checks, 11);
}

TEST_F(GuardLimits, FailuresAreCountedByTheirKindAndNamed) {
  struct Row {
    LinkResult result;
    ValveReason reason;
    std::int64_t ValveCounters::*counter;
  };
  for (const Row& row :
       {Row{LinkResult::no_answer, ValveReason::no_answer, &ValveCounters::no_answers},
        {LinkResult::broken, ValveReason::no_connection, &ValveCounters::broken},
        {LinkResult::exception_reply, ValveReason::failsafe_refused, &ValveCounters::exceptions}}) {
    const auto expect_count = [&](std::int64_t count) {
      const ValveCounters& counters = guard->counters();
      EXPECT_EQ(counters.exceptions + counters.no_answers + counters.broken, count);
      EXPECT_EQ(counters.*row.counter, count);
    };
    make();
    cycles_to(ValveState::securing);
    secure_result = row.result;
    const int tries = row.result == LinkResult::no_answer ? 3 : 1;  // two are tolerated
    EXPECT_EQ(cycles_to(ValveState::disconnected), tries);
    EXPECT_EQ(guard->reason(), row.reason);
    expect_count(tries);
    secure_result = LinkResult::ok;

    make();
    run();
    cycle(row.result);
    expect_count(1);
    commanding = false;
  }
}

TEST_F(GuardLimits, SilenceCountsFromTheFirstExchangeForOneValidity) {
  settings.wait_for_zero = true;
  for (const bool long_enough : {true, false}) {
    make();
    commanding = false;
    cycles_to(ValveState::starting);
    for (int k = 0; k <= (long_enough ? 20 : 19); ++k) cycle();
    EXPECT_EQ(guard->state(), ValveState::vented);
    EXPECT_EQ(guard->reason(), ValveReason::no_command) << "silence will do";
    commanding = true;
    cycle();
    EXPECT_EQ(guard->state(), long_enough ? ValveState::running : ValveState::vented);
  }
}

TEST_F(GuardLimits, SilenceWillDoAfterEveryFaultButNotAfterAnExpiryUnderPressure) {
  settings.wait_for_zero = true;
  const auto fault = [this] {
    read_back.diagnosis[0] = 1;
    cycle();
    ASSERT_EQ(guard->state(), ValveState::degraded);
    cycle();  // twice
    read_back.diagnosis[0] = 0;
  };
  for (const bool expires : {false, true}) {
    make();
    commanding = true;
    wanted = {0.0, 0.0};
    ASSERT_TRUE(reach(ValveState::running));
    wanted = {0.5, 1.0};
    for (int k = 0; k < 100; ++k) cycle();
    if (expires) {
      commanding = false;
      ASSERT_TRUE(reach(ValveState::vented));
      EXPECT_EQ(guard->reason(), ValveReason::waiting_for_zero);
    }
    fault();
    commanding = false;
    for (int k = 0; k < 300; ++k) cycle();
    ASSERT_EQ(guard->state(), ValveState::vented);
    commanding = true;
    cycle();
    EXPECT_EQ(guard->state(), expires ? ValveState::vented : ValveState::running);
  }
}

TEST_F(GuardLimits, AnotherSenderChangesNoStateBeforeTheTerminalIsReady) {
  for (const ValveState state :
       {ValveState::disconnected, ValveState::securing, ValveState::starting}) {
    make();
    ASSERT_TRUE(reach(state));
    command(0.0, 0.0);
    intrude();
    command(0.0, 0.0);
    EXPECT_EQ(guard->counters().other_senders, 1);
    EXPECT_EQ(guard->state(), state);
    guard->emergency_stop();
    EXPECT_EQ(guard->state(), state);
    guard->acknowledge();
    // Both have left: silence will do.
    for (int k = 0; k < 200; ++k) cycle();
    ASSERT_EQ(guard->state(), ValveState::vented);
    commanding = true;
    cycle();
    EXPECT_EQ(guard->state(), ValveState::running);
    commanding = false;
  }
  make();
  ASSERT_TRUE(reach(ValveState::vented));
  guard->emergency_stop();
  EXPECT_EQ(guard->state(), ValveState::degraded) << "at once";
}

}  // namespace
}  // namespace softarm
