// A valve guard stepped through time by hand, with a terminal that obeys or does not.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <memory>

#include "milliseconds.hpp"
#include "softarm/valves/valve_guard.hpp"

namespace softarm::test {

inline constexpr std::int64_t kPeriod = 5 * kMs;

/// A guard with two chambers at 200 Hz.
class GuardBench : public ::testing::Test {
 protected:
  void SetUp() override { make(); }
  void make() {
    settings.chambers = 2;
    guard = std::make_unique<ValveGuard>(settings);
  }

  /// A command as a controller at the cycle's rate sends it.
  void command(double a, double b, std::int64_t validity_ns = 100 * kMs) {
    pressures = {a, b};
    guard->command({.sequence = sequence++, .validity_ns = validity_ns, .pressure_bar = pressures},
                   now);
  }

  /// One cycle with a terminal that does `result`; its valves follow at once unless `stuck`.
  ValveAction cycle(LinkResult result = LinkResult::ok) {
    now += kPeriod;
    guard->wake(now);
    if (commanding) command(wanted[0], wanted[1]);
    const ValveAction action = guard->next(now);
    if (action == ValveAction::connect) guard->connected(reachable, now);
    if (action == ValveAction::secure) guard->secured(secure_result, as_written, now);
    if (action == ValveAction::exchange) exchange(result);
    return action;
  }
  void exchange(LinkResult result) {
    if (result == LinkResult::ok) {
      read_back.has_echo = has_echo;
      read_back.echo_bar = held;
      read_back.actual_bar = held;
      if (stuck_at >= 0) read_back.actual_bar[0] = stuck_at;
    }
    if (guard->may_read()) guard->measured(result, read_back, now);
    if (guard->failsafe_due(now)) {
      ++failsafe_checks;
      if (guard->failsafe_lost() && takes_failsafe) failsafe_is_set = true;
      guard->failsafe_checked(LinkResult::ok, failsafe_is_set, now);
    }
    if (!guard->may_write()) return;
    const Eigen::VectorXd before = written;
    written = guard->set_points_bar();
    EXPECT_GE(written.minCoeff(), 0.0);
    EXPECT_LE(written.maxCoeff(), settings.max_pressure_bar);
    if (guard->state() != ValveState::running) {
      EXPECT_TRUE(written.isZero());
    }
    const double slew_bar = 2.0 * to_seconds(kPeriod) * settings.slew_bar_per_s;
    EXPECT_LE((written - before).maxCoeff(), slew_bar + 1e-12) << "whoever commands it";
    const LinkResult wrote = result == LinkResult::ok ? write_result : result;
    if (wrote == LinkResult::ok && !ignores_writes) held = written;
    guard->written(wrote, now);
  }
  /// Cycles until `state`, at most `limit`.
  bool reach(ValveState state, int limit = 2000) {
    for (int k = 0; k < limit && guard->state() != state; ++k) cycle();
    return guard->state() == state;
  }
  /// The back-off is as long as the terminal needs to vent, and is kept to the end.
  void expect_silence(LinkResult result) {
    int cycles = 0;
    while (guard->state() != ValveState::disconnected) {
      ASSERT_LE(++cycles, 42) << "0.2 s";
      cycle(result);
    }
    EXPECT_EQ(guard->reason(), ValveReason::zero_unconfirmed);
    const std::int64_t since = now;
    while (cycle(result) == ValveAction::wait) {
    }
    EXPECT_GT(now - since, 300 * kMs);
  }
  void run() {
    commanding = true;
    ASSERT_TRUE(reach(ValveState::running));
    for (int k = 0; k < 100; ++k) cycle();
    ASSERT_DOUBLE_EQ(written[0], wanted[0]);
  }

  ValveGuardSettings settings;
  std::unique_ptr<ValveGuard> guard;
  std::int64_t now = 1000 * kMs;
  std::int64_t sequence = 0;
  std::array<double, 2> pressures{}, wanted{0.5, 1.0};
  bool commanding = false, reachable = true, as_written = true;
  LinkResult secure_result = LinkResult::ok;
  double stuck_at = -1.0;
  ReadBack read_back{2};
  bool has_echo = true;
  LinkResult write_result = LinkResult::ok;
  bool ignores_writes = false, failsafe_is_set = true, takes_failsafe = true;
  int failsafe_checks = 0;
  Eigen::VectorXd written = Eigen::VectorXd::Zero(2), held = written;
};

}  // namespace softarm::test
