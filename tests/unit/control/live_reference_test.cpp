// References that arrive message by message.
#include <gtest/gtest.h>

#include <cmath>

#include "softarm/control/reference.hpp"
#include "unit/control/arms.hpp"

namespace softarm {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr double kTimeout = 0.2;

ReferenceSettings live() { return {{{LiveReference{kTimeout}, 0.0}}}; }

struct Sender {
  Vector2d u(double t) const { return 0.5 * Vector2d(std::cos(2.0 * t), std::sin(3.0 * t)); }
  Vector2d velocity(double t) const { return {-std::sin(2.0 * t), 1.5 * std::cos(3.0 * t)}; }
  Vector2d acceleration(double t) const {
    return {-2.0 * std::cos(2.0 * t), -4.5 * std::sin(3.0 * t)};
  }
};

TEST(LiveReference, HoldsWhereTheArmIsUntilAMessageComes) {
  Reference reference(live(), test::gains(1, 1.0, 0.0), 1);
  EXPECT_EQ(reference.receive(0.0, Vector2d::Zero(), Vector2d::Zero(), Vector2d::Zero()),
            LiveVerdict::not_live);  // not started
  reference.start(0.0, Vector2d(0.3, -0.2), Vector2d(0.1, 0.0));
  EXPECT_LT((test::sampled(reference, 0.0).velocity - Vector2d(0.1, 0.0)).norm(), 1e-15);
  for (double t : {1.0, 2.0, 100.0}) {
    EXPECT_LT((test::sampled(reference, t).u - Vector2d(0.3, -0.2)).norm(), 1e-15);
    EXPECT_EQ(test::sampled(reference, t).velocity.norm(), 0.0);
  }
}

TEST(LiveReference, FollowsAStreamSmoothlyAndExactly) {
  const Sender sender;
  for (double period : {0.002, 0.01, 0.05}) {
    Reference reference(live(), test::gains(1, 1.0, 0.0), 1);
    reference.start(0.0, sender.u(0.0) + Vector2d(0.1, -0.1), Vector2d::Zero());
    double jump = 0.0, late_error = 0.0;
    for (int k = 0; k < static_cast<int>(4.0 / period); ++k) {
      const double t = k * period;
      const ReferenceSample before = test::sampled(reference, t);
      ASSERT_EQ(reference.receive(t, sender.u(t), sender.velocity(t), sender.acceleration(t)),
                LiveVerdict::accepted);
      const ReferenceSample after = test::sampled(reference, t);
      jump = std::max({jump, (after.u - before.u).norm(), (after.velocity - before.velocity).norm(),
                       (after.acceleration - before.acceleration).norm()});
      if (t < 1.5) continue;
      for (double part : {0.0, 0.3, 0.9}) {
        const double now = t + part * period;
        late_error = std::max(late_error, (test::sampled(reference, now).u - sender.u(now)).norm());
      }
    }
    EXPECT_LT(jump, 1e-9) << period;  // u, u' and u'' are continuous from message to message
    // What extrapolation by two derivatives leaves over a period, and what the jump of u'' from
    // message to message leaves for the blend (of 50 ms) to take away.
    EXPECT_LT(late_error, 20.0 * period * period * period + 5e-5) << period;
  }
}

TEST(LiveReference, ComesToRestAtTheLastMessage) {
  const Sender sender;
  Reference reference(live(), test::gains(1, 1.0, 0.0), 1);
  reference.start(0.0, sender.u(0.0), sender.velocity(0.0));
  for (int k = 0; k <= 100; ++k) {
    const double t = 0.01 * k;
    reference.receive(t, sender.u(t), sender.velocity(t), sender.acceleration(t));
  }
  const ReferenceSample last = test::sampled(reference, 1.0 + kTimeout - 1e-9),
                        rest = test::sampled(reference, 1.0 + kTimeout + 1e-9);
  EXPECT_LT((last.u - rest.u).norm(), 1e-7);
  EXPECT_LT((last.velocity - rest.velocity).norm(), 1e-7);
  EXPECT_LT((last.acceleration - rest.acceleration).norm(), 1e-6);
  EXPECT_LT((test::sampled(reference, 3.0).u - sender.u(1.0)).norm(), 1e-12);
  EXPECT_LT(test::sampled(reference, 3.0).velocity.norm(), 1e-12);
}

TEST(LiveReference, BlendsAStepAndRefusesALargerOne) {
  ControllerSettings control = test::gains(1, 1.0, 0.0);
  control.max_step_rad = 0.2;
  Reference reference(live(), control, 1);
  const Vector2d zero = Vector2d::Zero();
  reference.start(0.0, zero, zero);
  EXPECT_EQ(reference.receive(0.1, Vector2d(0.19, 0.0), zero, zero), LiveVerdict::accepted);
  EXPECT_LT(test::sampled(reference, 0.1).u.norm(), 1e-15);
  double fastest = 0.0;
  for (double t = 0.1; t < 2.0; t += 0.01) {
    fastest = std::max(fastest, test::sampled(reference, t).velocity.norm());
  }
  EXPECT_LT(fastest, 0.19 * 1.875 / 0.9);
  EXPECT_NEAR(test::sampled(reference, 2.0).u[0], 0.19, 1e-12);
  EXPECT_EQ(reference.receive(2.0, Vector2d(0.19, 0.21), zero, zero), LiveVerdict::step_too_large);
  EXPECT_NEAR(test::sampled(reference, 2.0).u[0], 0.19, 1e-12);  // nothing happened
  EXPECT_EQ(test::sampled(reference, 2.1).u[1], 0.0);
}

TEST(LiveReference, RefusesWhatIsNotFitToFollow) {
  Reference reference(live(), test::gains(1, 1.0, 0.0), 1);
  const Vector2d zero = Vector2d::Zero(), nan(NAN, 0.0), infinite(0.0, INFINITY);
  reference.start(0.0, zero, zero);
  EXPECT_EQ(reference.receive(0.1, VectorXd::Zero(4), zero, zero), LiveVerdict::wrong_size);
  EXPECT_EQ(reference.receive(0.1, zero, VectorXd::Zero(1), zero), LiveVerdict::wrong_size);
  EXPECT_EQ(reference.receive(0.1, nan, zero, zero), LiveVerdict::not_finite);
  EXPECT_EQ(reference.receive(0.1, zero, infinite, zero), LiveVerdict::not_finite);
  EXPECT_EQ(reference.receive(0.1, zero, zero, nan), LiveVerdict::not_finite);
  EXPECT_EQ(reference.receive(0.1, Vector2d(2.6, 0.0), zero, zero), LiveVerdict::out_of_limits);
  EXPECT_EQ(reference.receive(0.1, zero, Vector2d(0.0, 21.0), zero), LiveVerdict::out_of_limits);
  EXPECT_EQ(reference.receive(0.1, zero, zero, Vector2d(1e3, 0.0)), LiveVerdict::out_of_limits);
  EXPECT_EQ(test::sampled(reference, 5.0).u.norm(), 0.0);
}

TEST(LiveReference, OnlyItsOwnPhaseListens) {
  const Vector2d zero = Vector2d::Zero();
  ReferenceSettings settings;
  settings.phases = {{SetPointReference{{0.1, 0.0}}, 1.0},
                     {LiveReference{kTimeout}, 1.0},
                     {SetPointReference{{0.2, 0.0}}, 0.0}};
  Reference reference(settings, test::gains(1, 1.0, 0.0), 1);
  reference.start(0.0, Vector2d(0.1, 0.0), zero);
  EXPECT_EQ(reference.receive(0.5, zero, zero, zero), LiveVerdict::not_live);
  EXPECT_EQ(reference.receive(1.9, Vector2d(0.1, 0.1), Vector2d(0.5, 0.0), zero),
            LiveVerdict::accepted);
  // The next phase is joined to what the message made of this one.
  const ReferenceSample before = test::sampled(reference, 2.0 - 1e-9),
                        after = test::sampled(reference, 2.0);
  EXPECT_LT((before.u - after.u).norm(), 1e-7);
  EXPECT_LT((before.velocity - after.velocity).norm(), 1e-7);
  EXPECT_EQ(reference.receive(2.5, zero, zero, zero), LiveVerdict::not_live);
  EXPECT_LT((test::sampled(reference, 4.0).u - Vector2d(0.2, 0.0)).norm(), 1e-12);
}

TEST(LiveReference, WindowDoesNotReachOverAMessage) {
  const Vector2d zero = Vector2d::Zero();
  Reference reference(live(), test::gains(1, 1.0, 0.0), 1);
  reference.start(0.0, zero, zero);
  reference.receive(1.0, Vector2d(0.1, 0.0), Vector2d(1.0, 0.0), zero);
  ReferenceWindow window;
  reference.window(1.004, 0.01, window);
  EXPECT_NEAR(window.interval_s, 0.014, 1e-12);
  // The difference quotient is the velocity, message or not.
  EXPECT_LT(((window.after.u - window.before.u) / window.interval_s - window.now.velocity).norm(),
            0.05);
}

}  // namespace
}  // namespace softarm
