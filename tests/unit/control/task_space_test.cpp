// (21) online: what the tip does on an arm that follows exactly, and what happens where J is
// singular, redundant or of no use.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "counted_malloc.hpp"
#include "dense_solvers.hpp"
#include "softarm/control/inverse_kinematics.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/model/kinematics.hpp"
#include "unit/control/arms.hpp"

namespace softarm {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using std::numbers::pi;

/// Section VI: four segments, 1 m.
ArmParameters long_arm(int n = 4) {
  ArmParameters arm;
  arm.segments.assign(static_cast<std::size_t>(n), {1.0 / n, 1.0 / n, 2.0, 0.5});
  return arm;
}

ControllerSettings settings(int n, double lambda, double bandwidth) {
  ControllerSettings control = test::gains(n, 2.0, 0.3);
  control.max_theta_rad = 3.0;
  control.task_space = {lambda, bandwidth, 2.0};
  return control;
}

TipPathReference point(const Vector3d& where) {
  TipPathReference path;
  path.shape = TipPathShape::point;
  path.centre_m = where;
  return path;
}

ReferenceSettings only(ReferenceKind kind) { return {{{std::move(kind), 0.0}}}; }

/// An arm that is where its reference is, and whose tip is `offset` off its own kinematics.
class ExactArm {
 public:
  ExactArm(const ArmParameters& arm, const ReferenceSettings& phases,
           const ControllerSettings& control)
      : reference_(phases, control, arm), arm_(arm), control_(control) {}

  void start(const VectorXd& u) {
    now_.u = u;
    reference_.measure_tip(time_s_, tip());
    reference_.start(time_s_, u, VectorXd::Zero(u.size()));
    reference_.sample(time_s_, now_);
  }

  /// One tick of 2 ms; what the reference guarantees at any time is checked in each.
  void tick() {
    reference_.measure_tip(time_s_, tip());
    const ReferenceSample before = now_;
    time_s_ += kTick_s;
    reference_.advance(time_s_);
    reference_.sample(time_s_, now_);
    ASSERT_TRUE(now_.acceleration.allFinite());
    // u, u' and u'' belong together.
    EXPECT_LT((now_.u - before.u - kTick_s * before.velocity -
               0.5 * kTick_s * kTick_s * before.acceleration)
                  .norm(),
              1e-11);
    EXPECT_LT((now_.velocity - before.velocity - kTick_s * before.acceleration).norm(), 1e-9);
    for (Eigen::Index i = 0; i < now_.u.size(); i += 2) {
      EXPECT_LE(now_.u.segment<2>(i).norm(), control_.max_theta_rad);
      EXPECT_LE(now_.velocity.segment<2>(i).norm(), control_.max_speed_radps * (1.0 + 1e-9));
    }
  }
  void run(double duration_s) {
    for (double end = time_s_ + duration_s - 0.5 * kTick_s; time_s_ < end;) tick();
  }

  Vector3d tip() const { return tip_position(arm_, now_.u) + offset; }
  Vector3d error() const { return now_.tip.position_m - tip(); }
  const ReferenceSample& now() const { return now_; }
  double time_s() const { return time_s_; }
  Reference& reference() { return reference_; }

  Vector3d offset = Vector3d::Zero();
  static constexpr double kTick_s = 0.002;

 private:
  Reference reference_;
  ArmParameters arm_;
  ControllerSettings control_;
  ReferenceSample now_;
  double time_s_ = 10.0;
};

TEST(TipPath, DefaultIsTheLemniscateOf22) {
  for (double t = 0.0; t < 12.0; t += 0.37) {
    const TipReference at = TipPathReference{}.tip(t);
    EXPECT_NEAR(at.position_m.x(), -0.25, 1e-15);
    EXPECT_NEAR(at.position_m.y(), std::cos(pi * t / 5.0) / 3.0, 1e-14);
    EXPECT_NEAR(at.position_m.z(), -0.5 + std::sin(2.0 * pi * t / 5.0) / 6.0, 1e-14);
  }
}

TEST(TipPath, DerivativesAreThoseOfThePosition) {
  constexpr double kShort = 1e-4;
  for (const TipPathShape shape :
       {TipPathShape::point, TipPathShape::circle, TipPathShape::lemniscate}) {
    TipPathReference path{shape, {0.1, 0.2, -0.4}, {0.3, 0.1, 0.0}, {0.0, 0.1, 0.2}, 1.7};
    for (double t = 0.1; t < 5.0; t += 0.31) {
      const TipReference a = path.tip(t - kShort), m = path.tip(t), b = path.tip(t + kShort);
      EXPECT_LT((m.velocity_mps - (b.position_m - a.position_m) / (2.0 * kShort)).norm(), 1e-7);
      EXPECT_LT((m.acceleration_mps2 - (b.velocity_mps - a.velocity_mps) / (2.0 * kShort)).norm(),
                1e-6);
    }
  }
}

TEST(DampedInverse, IsThePseudoInverseWhereNoDirectionIsHard) {
  test::Random random(1);
  int compared = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const int n = 2 + trial % 5;
    Eigen::Matrix3Xd J(3, 2 * n);
    tip_jacobian(test::random_arm(n, random), random.vector(2 * n, 2.0), J);
    const double hard = 0.02;
    if (test::singular_values(J)[2] < hard) continue;
    ++compared;
    const MatrixXd exact = test::pseudo_inverse(J);
    const MatrixXd ours = J.transpose() * damped_inverse(J, hard);
    EXPECT_LT((ours - exact).norm(), 1e-9 * exact.norm());
  }
  EXPECT_GT(compared, 100);
}

TEST(DampedInverse, IsBoundedAndContinuousThroughTheStraightPose) {
  const ArmParameters arm = long_arm();
  const double hard = 0.05;
  const VectorXd bend = VectorXd::Constant(8, 1.0);
  MatrixXd last;
  double largest_step = 0.0, smallest_sigma = 1.0;
  for (int k = -4000; k <= 4000; ++k) {
    Eigen::Matrix3Xd J(3, 8);
    tip_jacobian(arm, 1e-4 * k * bend, J);
    const MatrixXd inverse = J.transpose() * damped_inverse(J, hard);
    smallest_sigma = std::min(smallest_sigma, test::singular_values(J)[2]);
    EXPECT_LE(test::singular_values(inverse)[0], 1.3 / hard);
    if (last.size() > 0) largest_step = std::max(largest_step, (inverse - last).norm());
    last = inverse;
  }
  EXPECT_LT(smallest_sigma, 1e-12) << "the test must pass the singularity";
  EXPECT_LT(largest_step, 0.2);  // of some 26 / m; the plain pseudo-inverse leaps by infinity
}

TEST(TaskSpace, TheTipOfAnExactArmIsOnThePathOnceItIsJoined) {
  for (int n : {3, 4, 10}) {  // two segments do not reach all of (22)
    ExactArm arm(long_arm(n), only(TipPathReference{}), settings(n, 10.0, 20.0));
    arm.start(VectorXd::Constant(2 * n, 1.0 / n));
    arm.run(4.0);  // blend_s = 1, then three seconds to forget the start at a singular pose
    for (int k = 0; k < 1000; ++k) {
      arm.tick();
      ASSERT_LT(arm.error().norm(), 2e-5) << n << " segments at " << arm.time_s();
      EXPECT_FALSE(arm.now().limited);
    }
  }
}

/// A tip that is suddenly d off the model's is brought back by e'' + 2 L e' + L^2 e = -d'' - 2 L d'
/// with d known at once: e = -d (1 - L t) exp(-L t) after the step.
TEST(TaskSpace, AnOffsetTipConvergesAtLambda) {
  const double lambda = 4.0;
  ControllerSettings control = settings(4, lambda, 300.0);
  ExactArm arm(long_arm(), only(point({-0.25, 0.1, -0.6})), control);
  arm.start(VectorXd::Constant(8, 0.4));
  arm.run(8.0);
  ASSERT_LT(arm.error().norm(), 1e-5);
  arm.offset = {0.006, -0.004, 0.008};
  const Vector3d d = arm.offset;
  const double begin = arm.time_s();
  for (int k = 0; k < 1000; ++k) {
    arm.tick();
    const double t = arm.time_s() - begin;
    const Vector3d expected = -d * (1.0 - lambda * t) * std::exp(-lambda * t);
    // The filter, a few ticks wide, is all that the law does not know.
    ASSERT_LT((arm.error() - expected).norm(), 0.1 * d.norm()) << t;
  }
  EXPECT_LT(arm.error().norm(), 0.02 * d.norm());
}

TEST(TaskSpace, LateMeasurementsDoNotMatterToAnArmThatFollows) {
  const ArmParameters arm = long_arm();
  const ControllerSettings control = settings(4, 20.0, 60.0);
  Reference reference(only(TipPathReference{}), control, arm);
  const VectorXd u = VectorXd::Constant(8, 0.3);
  reference.measure_tip(0.0, tip_position(arm, u));
  reference.start(0.0, u, VectorXd::Zero(8));
  ReferenceSample now, then;
  // 40 ms late: fed back as it comes, lambda = 20 / s would be unstable.
  for (int k = 1; k < 5000; ++k) {
    const double t = 0.002 * k;
    reference.sample(t - 0.04, then);
    if (t > 0.04) reference.measure_tip(t - 0.04, tip_position(arm, then.u));
    reference.advance(t);
    reference.sample(t, now);
    if (t > 5.0) {
      ASSERT_LT((tip_position(arm, now.u) - now.tip.position_m).norm(), 1e-3) << t;
    }
  }
}

/// The inverse of the valve lag differentiates the reference over a few hundredths of a second about
/// now: without the jerk it would miss the lag of B u'', and the faster the path the more.
TEST(TaskSpace, TheReferenceIsKnownAheadWithItsJerk) {
  TipPathReference circle{
      TipPathShape::circle, {0.0, 0.0, -0.7}, {0.2, 0.0, 0.0}, {0.0, 0.2, 0.0}, 3.0};
  ExactArm arm(long_arm(), only(circle), settings(4, 10.0, 20.0));
  arm.start(VectorXd::Constant(8, 0.4));
  arm.run(6.0);
  ReferenceSample ahead;
  arm.reference().sample(arm.time_s() + 0.03, ahead);
  const VectorXd now = arm.now().acceleration;
  arm.run(0.03);
  const double change = (arm.now().acceleration - now).norm();
  EXPECT_GT(change, 0.1);
  EXPECT_LT((ahead.acceleration - arm.now().acceleration).norm(), 0.15 * change);
  EXPECT_LT((ahead.u - arm.now().u).norm(), 1e-5);
}

TEST(TaskSpace, PassesTheStraightPoseAndStartsFromIt) {
  // Down the axis of the hanging arm to full length and up again on the other side.
  for (int n : {2, 4}) {
    TipPathReference swing{
        TipPathShape::circle, {0.0, 0.0, -0.9}, {0.3, 0.0, 0.0}, {0.0, 0.0, 0.1}, 1.0};
    ExactArm arm(long_arm(n), only(swing), settings(n, 10.0, 20.0));
    arm.start(VectorXd::Zero(2 * n));
    double straightest = 10.0, fastest = 0.0;
    for (int k = 0; k < 10000; ++k) {
      arm.tick();
      straightest = std::min(straightest, arm.now().u.norm());
      if (arm.time_s() > 12.0) fastest = std::max(fastest, arm.now().velocity.norm());
    }
    EXPECT_LT(fastest, 6.0) << n;
  }
}

TEST(TaskSpace, APathOutOfReachEndsStretchedTowardsItAtRest) {
  const ArmParameters arm_parameters = long_arm();
  for (const Vector3d& where : {Vector3d(0.0, 0.0, -1.5), Vector3d(1.2, 0.0, -0.9),
                                Vector3d(0.0, -3.0, 0.0), Vector3d(0.0, 0.0, -1.0)}) {
    ExactArm arm(arm_parameters, only(point(where)), settings(4, 8.0, 20.0));
    arm.start(VectorXd::Constant(8, 0.2));
    arm.run(40.0);
    EXPECT_LT(arm.now().velocity.norm(), 0.02) << where.transpose();
    // As far in its direction as a bent arm gets: an arm on a base that points down cannot turn.
    const double ahead = arm.tip().dot(where.normalized());
    EXPECT_GT(ahead, 0.75) << where.transpose();
    EXPECT_LT(arm.tip().norm(), 1.0 + 1e-12);
    EXPECT_EQ(arm.now().limited, arm.error().norm() > 0.25);
  }
}

TEST(TaskSpace, OneSegmentDoesItsBest) {
  // The tip of one segment moves on a surface; the point of it next to the target is where the
  // error is along the normal.
  const ArmParameters arm_parameters = long_arm(1);
  ExactArm arm(arm_parameters, only(point({0.5, 0.3, -0.6})), settings(1, 8.0, 20.0));
  arm.start(VectorXd::Zero(2));
  arm.run(20.0);
  Eigen::Matrix3Xd J(3, 2);
  tip_jacobian(arm_parameters, arm.now().u, J);
  EXPECT_LT((J.transpose() * arm.error()).norm(), 1e-6);
  EXPECT_LT(arm.now().velocity.norm(), 1e-6);
}

TEST(TaskSpace, PosturesDoNotDriftOverAHundredSeconds) {
  ExactArm arm(long_arm(), only(TipPathReference{}), settings(4, 10.0, 20.0));
  VectorXd start(8);
  start << 0.3, -0.2, -0.4, 0.5, 0.6, 0.1, -0.3, 0.2;
  arm.start(start);
  arm.run(30.0);
  const VectorXd early = arm.now().u;
  arm.run(70.0);  // seven periods of (22)
  EXPECT_LT((arm.now().u - early).norm(), 1e-3);
  EXPECT_LT(arm.error().norm(), 2e-5);
}

TEST(TaskSpace, PostureOfLeastBendIsFoundFromAnywhere) {
  const Vector3d where(-0.25, 0.1, -0.6);
  VectorXd first;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    test::Random random(seed);
    const ArmParameters arm_parameters = long_arm(3);
    ExactArm arm(arm_parameters, only(point(where)), settings(3, 10.0, 20.0));
    arm.start(random.vector(6, 0.5));
    arm.run(60.0);
    EXPECT_LT(arm.error().norm(), 1e-6);
    // A stationary point of |u|^2 with the tip held: u is in the row space of J.
    Eigen::Matrix3Xd J(3, 6);
    tip_jacobian(arm_parameters, arm.now().u, J);
    const MatrixXd inverse = test::pseudo_inverse(J);
    const VectorXd in_null_space = arm.now().u - inverse * (J * arm.now().u);
    EXPECT_LT(in_null_space.norm(), 1e-4);
  }
}

TEST(TaskSpace, PhasesOfBothKindsJoinSmoothly) {
  const std::vector<double> pose = {0.2, 0.1, 0.3, 0.0, 0.4, -0.2, 0.1, 0.5};
  const ReferenceSettings phases = {{{SetPointReference{pose}, 2.0},
                                     {TipPathReference{}, 3.0},
                                     {point({-0.2, 0.2, -0.6}), 2.0},
                                     {PaperReference{}, 2.0},
                                     {SetPointReference{pose}, 0.0}}};
  ExactArm arm(long_arm(), phases, settings(4, 10.0, 20.0));
  arm.start(VectorXd::Constant(8, 0.1));
  ReferenceSample before = arm.now();
  for (int k = 0; k < 6000; ++k) {
    // Not tick(): a quintic is not quadratic between ticks.
    const double t = 10.0 + 0.002 * (k + 1);
    arm.reference().measure_tip(t - 0.002, tip_position(long_arm(), before.u));
    arm.reference().advance(t);
    ReferenceSample now;
    arm.reference().sample(t, now);
    ASSERT_LT((now.u - before.u - 0.001 * (now.velocity + before.velocity)).norm(), 2e-5) << t;
    ASSERT_LT((now.velocity - before.velocity).norm(), 0.5) << t;
    EXPECT_EQ(now.has_tip, t >= 12.0 && t < 17.0) << t;
    before = now;
  }
  EXPECT_LT((before.u - Eigen::Map<const VectorXd>(pose.data(), 8)).norm(), 1e-12);
}

TEST(TaskSpace, StartsAgainAfterAStop) {
  ExactArm arm(long_arm(), only(TipPathReference{}), settings(4, 10.0, 20.0));
  arm.start(VectorXd::Constant(8, 0.3));
  arm.run(3.0);
  const VectorXd elsewhere = VectorXd::Constant(8, -0.1);
  arm.start(elsewhere);
  EXPECT_EQ(arm.now().u, elsewhere);
  EXPECT_EQ(arm.now().velocity, VectorXd::Zero(8));
  arm.run(4.0);
  EXPECT_LT(arm.error().norm(), 2e-5);
}

TEST(TaskSpace, AllocatesNothing) {
  const ArmParameters arm = long_arm(10);
  Reference reference(only(TipPathReference{}), settings(10, 10.0, 20.0), arm);
  const VectorXd u = VectorXd::Constant(20, 0.1);
  ReferenceWindow window;
  Vector3d tip = tip_position(arm, u);
  const long before = test::allocations;
  reference.start(0.0, u, u);
  for (int k = 1; k < 10000; ++k) {
    reference.measure_tip(1e-3 * k - 0.005, tip);
    reference.advance(1e-3 * k);
    reference.window(1e-3 * k, 0.01, window);
    tip = tip_position(arm, window.now.u);
  }
  EXPECT_EQ(test::allocations - before, 0);
  EXPECT_GT(window.interval_s, 0.0);
}

TEST(TaskSpace, RefusesWhatItCannotUse) {
  EXPECT_THROW(Reference(only(TipPathReference{}), settings(4, 10.0, 20.0), 4),
               std::invalid_argument);
  EXPECT_THROW(Reference(only(TipPathReference{}), settings(4, 0.0, 20.0), long_arm()),
               std::invalid_argument);
  EXPECT_THROW(Reference(only(TipPathReference{}), settings(4, 10.0, -1.0), long_arm()),
               std::invalid_argument);
  ControllerSettings negative = settings(4, 10.0, 20.0);
  negative.task_space.map_rate_1ps = -1.0;
  EXPECT_THROW(Reference(only(TipPathReference{}), negative, long_arm()), std::invalid_argument);
  EXPECT_THROW(Reference(only(point({0.0, std::numeric_limits<double>::quiet_NaN(), 0.0})),
                         settings(4, 10.0, 20.0), long_arm()),
               std::invalid_argument);
}

}  // namespace
}  // namespace softarm
