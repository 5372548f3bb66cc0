// Live targets of the tip, and references that stay where the chambers can hold the arm.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "counted_malloc.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/statics.hpp"
#include "softarm/runtime/static_hold.hpp"
#include "unit/runtime/pipeline_bench.hpp"

namespace softarm {
namespace {

using Eigen::Vector3d;

constexpr double kStep_s = 0.002;

/// An arm that is where its reference is.
class Follower {
 public:
  explicit Follower(const Experiment& experiment, ReferenceKind kind = LiveTipReference{})
      : arm_(experiment.arm),
        hold_(experiment.arm, experiment.actuation),
        reference_({{{std::move(kind), 0.0}}}, experiment.control, experiment.arm) {
    reference_.hold_within(hold_);
    now_.u.setConstant(arm_.dof(), 0.05);
    reference_.measure_tip(0.0, tip());
    reference_.start(0.0, now_.u, SegmentVector::Zero(arm_.dof()));
  }
  LiveVerdict send(const Vector3d& position_m, const Vector3d& velocity_mps = Vector3d::Zero()) {
    return reference_.receive_tip(time_s_, position_m, velocity_mps);
  }
  void step() {
    const Vector3d before = tip();
    time_s_ += kStep_s;
    reference_.measure_tip(time_s_ - kStep_s, before);
    reference_.advance(time_s_);
    reference_.sample(time_s_, now_);
    fastest_mps_ = std::max(fastest_mps_, (tip() - before).norm() / kStep_s);
    for (int i = 0; i < arm_.size(); ++i)
      most_theta_rad_ = std::max(most_theta_rad_, now_.u.segment<2>(2 * i).norm());
  }
  void run(double seconds) {
    for (int k = 0; k < seconds / kStep_s; ++k) step();
  }
  Vector3d tip() const { return tip_position(arm_, now_.u); }

  ArmParameters arm_;
  StaticHold hold_;
  Reference reference_;
  ReferenceSample now_;
  double time_s_ = 0.0, fastest_mps_ = 0.0, most_theta_rad_ = 0.0;
};

TEST(LiveTip, StaysUntilATargetComesAndThenGoesThere) {
  Follower it(test::paper_arm());
  const Vector3d first = it.tip();
  it.run(1.0);
  EXPECT_LT((it.tip() - first).norm(), 1e-3);
  const Vector3d target = first + Vector3d(0.05, -0.04, 0.02);
  it.fastest_mps_ = 0.0;
  ASSERT_EQ(it.send(target), LiveVerdict::accepted);
  it.run(3.0);
  EXPECT_LT((it.tip() - target).norm(), 1e-3) << "one message is enough";
  EXPECT_LT(it.fastest_mps_, 1.1 * 0.2) << "max_speed_mps";
}

TEST(LiveTip, FollowsASlowAndAFastStream) {
  const auto path = [](double t) {
    return Vector3d(0.04 * std::cos(t), 0.04 * std::sin(t), -0.31);
  };
  const auto rate = [](double t) { return Vector3d(-0.04 * std::sin(t), 0.04 * std::cos(t), 0.0); };
  for (const double period_s : {0.2, 0.01}) {
    Follower it(test::paper_arm(), LiveTipReference{.timeout_s = 0.5});
    double next_s = 0.0, largest_m = 0.0;
    while (it.time_s_ < 12.0) {
      if (it.time_s_ >= next_s) {
        ASSERT_EQ(it.send(path(it.time_s_), rate(it.time_s_)), LiveVerdict::accepted);
        next_s += period_s;
      }
      it.step();
      if (it.time_s_ > 6.0) largest_m = std::max(largest_m, (it.tip() - path(it.time_s_)).norm());
    }
    EXPECT_LT(largest_m, 5e-4 + 0.5 * 0.04 * period_s * period_s) << period_s;
  }
}

TEST(LiveTip, AMovingTargetThatFallsSilentStops) {
  Follower it(test::paper_arm(), LiveTipReference{.timeout_s = 0.2});
  const Vector3d first = it.tip(), rate(0.05, 0.0, 0.0);
  ASSERT_EQ(it.send(first, rate), LiveVerdict::accepted);
  it.run(5.0);
  const Vector3d rest = it.tip();
  EXPECT_GT(rest.x() - first.x(), 0.009) << "0.2 s at 0.05 m/s and the way to stop";
  EXPECT_LT(rest.x() - first.x(), 0.03);
  it.run(1.0);
  EXPECT_LT((it.tip() - rest).norm(), 1e-4);
}

TEST(LiveTip, WhatCannotBeIsRefusedWithItsReason) {
  const Experiment experiment = test::paper_arm();
  Follower it(experiment);
  const Vector3d first = it.tip();
  const auto refuses = [&](LiveVerdict why, const Vector3d& position,
                           const Vector3d& velocity = Vector3d::Zero()) {
    EXPECT_EQ(it.send(position, velocity), why) << name(why);
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  refuses(LiveVerdict::unreachable, Vector3d(0.0, 0.0, -0.4));    // further than the arm is long
  refuses(LiveVerdict::unreachable, Vector3d(0.0, 0.0, 0.3));     // behind its base
  refuses(LiveVerdict::unreachable, Vector3d(0.32, 0.0, -0.05));  // it would have to turn sharply
  refuses(LiveVerdict::not_finite, Vector3d(kNan, 0.0, -0.3));
  refuses(LiveVerdict::not_finite, first, Vector3d(0.0, HUGE_VAL, 0.0));
  refuses(LiveVerdict::out_of_limits, first, Vector3d(0.3, 0.0, 0.0));
  it.run(2.0);
  EXPECT_LT((it.tip() - first).norm(), 1e-3) << "none of them moved it";
  Follower fixed(experiment, SetPointReference{{0, 0, 0, 0, 0, 0}});
  EXPECT_EQ(fixed.send(first), LiveVerdict::not_live);
}

/// Weak chambers: half a bar of the paper's two.
Experiment weak() {
  Experiment experiment = test::paper_arm();
  experiment.actuation.max_pressure_bar = 0.5;
  return experiment;
}

TEST(StaticHold, AgreesWithTheAllocationOfStaticMoments) {
  for (const bool torque : {false, true}) {
    Experiment experiment = weak();
    if (torque) set_torque_actuation(experiment.actuation, 3, 0.4);
    StaticHold hold(experiment.arm, experiment.actuation);
    const PressureAllocator allocator(experiment.actuation);
    DynamicsWorkspace workspace(experiment.arm);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> number(-0.8, 0.8);
    SegmentVector u(6), force(6), moments(6), bend(3);
    Allocation allocation;
    int held = 0;
    for (int k = 0; k < 2000; ++k) {
      for (double& each : u) each = number(random);
      static_moments(experiment.arm, workspace, u, force);
      solve_actuation(experiment.arm, u, force, moments);
      allocator.allocate(moments, allocation);
      hold.largest_bend(u, bend);
      for (int i = 0; i < 3; ++i) {
        const bool can = u.segment<2>(2 * i).norm() <= bend[i];
        EXPECT_EQ(can, allocation.scale[i] >= 1.0) << k << ' ' << i;
        held += can ? 1 : 0;
      }
    }
    EXPECT_GT(held, 1000);
    EXPECT_LT(held, 5900);
    hold.largest_bend(SegmentVector::Zero(6), bend);
    EXPECT_GT(bend.minCoeff(), 0.3) << "straight it can be bent";
  }
}

TEST(StaticHold, LiveReferencesBeyondItAreRefused) {
  Experiment experiment = weak();
  Follower it(experiment, LiveReference{});
  SegmentVector u = SegmentVector::Zero(6), zero = u;
  experiment.control.max_step_rad = 2.0;
  u[0] = 0.1;
  EXPECT_EQ(it.reference_.receive(0.0, u, zero, zero), LiveVerdict::accepted);
  u[0] = 1.5;
  EXPECT_EQ(it.reference_.receive(0.1, u, zero, zero), LiveVerdict::not_held);
}

// Beyond what the chambers hold u_ref waits at the limit, and turns back as soon as the path does.
TEST(StaticHold, ThePathOfTheTipDoesNotWindUp) {
  const auto towards = [](double t) -> TipReference {
    TipReference path;
    path.position_m = Vector3d(t < 4.0 ? 0.28 : 0.02, 0.0, -0.2);
    return path;
  };
  struct Step {
    std::function<TipReference(double)> path;
    const char* name() const noexcept { return "step"; }
    void check(const ReferencePlace&, const ControllerSettings&, int) const {}
    TipReference tip(double t) const noexcept { return path(t); }
  };
  const Experiment experiment = weak();
  Follower it(experiment, Step{towards});
  const auto overload = [&] {
    SegmentVector bend(3);
    it.hold_.largest_bend(it.now_.u, bend);
    double most = -1.0;
    for (int i = 0; i < 3; ++i) most = std::max(most, it.now_.u.segment<2>(2 * i).norm() - bend[i]);
    return most;
  };
  double largest = 0.0;
  while (it.time_s_ < 4.0) {
    it.step();
    largest = std::max(largest, overload());
  }
  EXPECT_LT(largest, 0.03) << "rad beyond what can be held, on the way there";
  EXPECT_LT(overload(), 0.0) << "and within it at rest";
  EXPECT_TRUE(it.now_.limited);
  EXPECT_GT(it.now_.u.norm(), 0.4) << "as far as it goes";
  const Vector3d there = it.tip();
  it.run(0.4);
  EXPECT_GT((it.tip() - there).norm(), 0.02) << "it turns back at once";
}

TEST(StaticHold, TakesNoMemory) {
  const Experiment experiment = test::paper_arm();
  Follower it(experiment);
  const long allocated = test::thread_allocations, released = test::thread_releases;
  for (int k = 0; k < 500; ++k) {
    it.step();
    it.send(Vector3d(0.001 * (k % 100), 0.0, -0.3 - 0.001 * (k % 80)));
  }
  EXPECT_EQ(test::thread_allocations - allocated, 0);
  EXPECT_EQ(test::thread_releases - released, 0);
}

}  // namespace
}  // namespace softarm
