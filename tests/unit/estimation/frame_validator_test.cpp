#include "softarm/estimation/frame_validator.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "frames.hpp"

namespace softarm {
namespace {

using test::arm_of;
using test::frame_of;

constexpr std::int64_t kPeriodNs = 5'000'000;

class Validator : public testing::Test {
 protected:
  ArmParameters arm = arm_of(3);
  EstimationSettings settings;
  FrameValidator validator{settings, arm, body_noise(settings, 3)};
  Eigen::VectorXd u = (Eigen::VectorXd(6) << 0.4, 0.1, -0.3, 0.2, 0.1, -0.5).finished();

  MocapFrame frame(std::int64_t number, std::int64_t capture_ns) const {
    MocapFrame out = frame_of(arm, u, test::some_base());
    out.frame_number = number;
    out.capture_ns = capture_ns;
    return out;
  }
  MocapFrame frame(std::int64_t number) const { return frame(number, number * kPeriodNs); }
};

TEST_F(Validator, AcceptsAStreamAndHandsOnTheEstimate) {
  for (int k = 1; k <= 100; ++k) {
    u[0] += 0.01;
    ASSERT_EQ(validator.accept(frame(k)), FrameVerdict::accepted);
    EXPECT_LT((validator.estimate().u_rad - u).norm(), 1e-13);
    EXPECT_EQ(validator.identical_in_row(), 0);
  }
  EXPECT_EQ(validator.counters().accepted, 100);
  EXPECT_EQ(validator.counters().rejected(), 0);
  EXPECT_EQ(validator.counters().missing, 0);
}

TEST_F(Validator, CountsNumbersRepeatedMissingAndOld) {
  EXPECT_EQ(validator.accept(frame(10)), FrameVerdict::accepted);
  EXPECT_EQ(validator.accept(frame(10)), FrameVerdict::repeated);
  EXPECT_EQ(validator.accept(frame(14)), FrameVerdict::accepted);
  EXPECT_EQ(validator.accept(frame(12)), FrameVerdict::out_of_order);
  EXPECT_EQ(validator.accept(frame(13)), FrameVerdict::out_of_order);
  EXPECT_EQ(validator.accept(frame(15)), FrameVerdict::accepted);
  EXPECT_EQ(validator.counters().repeated, 1);
  EXPECT_EQ(validator.counters().missing, 3);
  EXPECT_EQ(validator.counters().out_of_order, 2);
  // A new number at an old time is no news either.
  EXPECT_EQ(validator.accept(frame(16, 15 * kPeriodNs)), FrameVerdict::out_of_order);
  EXPECT_EQ(validator.accept(frame(17)), FrameVerdict::accepted);
  EXPECT_EQ(validator.counters().missing, 3);
}

TEST_F(Validator, NoticesASenderThatBeganAgain) {
  EXPECT_EQ(validator.accept(frame(5000)), FrameVerdict::accepted);
  u *= -1.0;  // meanwhile the arm has moved
  EXPECT_EQ(validator.accept(frame(0, 5001 * kPeriodNs)), FrameVerdict::sender_restarted);
  EXPECT_EQ(validator.accept(frame(1, 5002 * kPeriodNs)), FrameVerdict::accepted);
  EXPECT_EQ(validator.accept(frame(2, 5003 * kPeriodNs)), FrameVerdict::accepted);
  EXPECT_EQ(validator.counters().restarted, 1);
  EXPECT_EQ(validator.counters().missing, 0);
}

TEST_F(Validator, NoticesASenderThatBeganAgainAfterFewFrames) {
  for (int k = 0; k < 8; ++k) EXPECT_EQ(validator.accept(frame(k)), FrameVerdict::accepted);
  EXPECT_EQ(validator.accept(frame(0, 10 * kPeriodNs)), FrameVerdict::out_of_order);
  EXPECT_EQ(validator.accept(frame(1, 11 * kPeriodNs)), FrameVerdict::out_of_order);
  EXPECT_EQ(validator.accept(frame(2, 12 * kPeriodNs)), FrameVerdict::sender_restarted);
  EXPECT_EQ(validator.accept(frame(3, 13 * kPeriodNs)), FrameVerdict::accepted);
}

TEST_F(Validator, SurvivesAnyNumber) {
  constexpr auto kLeast = std::numeric_limits<std::int64_t>::min();
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(validator.accept(frame(kLeast, 1)), FrameVerdict::accepted);
  EXPECT_EQ(validator.accept(frame(kMost, 2)), FrameVerdict::accepted);
  EXPECT_EQ(validator.accept(frame(kLeast, 3)), FrameVerdict::sender_restarted);
  EXPECT_EQ(validator.accept(frame(kMost, kMost)), FrameVerdict::accepted);
  EXPECT_GT(validator.counters().missing, 0);
}

TEST_F(Validator, RejectsWhatIsNotAPose) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  ASSERT_EQ(validator.accept(frame(1)), FrameVerdict::accepted);
  std::int64_t number = 2;
  for (const double bad : {kNan, kInf, -kInf}) {
    MocapFrame one = frame(number++);
    one.body[2].position_m.y() = bad;
    EXPECT_EQ(validator.accept(one), FrameVerdict::not_finite);
    MocapFrame two = frame(number++);
    two.body[3].orientation.z() = bad;
    EXPECT_EQ(validator.accept(two), FrameVerdict::not_finite);
  }
  for (const double norm : {0.0, 0.97, 1.03, 1e200}) {
    MocapFrame one = frame(number++);
    one.body[0].orientation.coeffs() *= norm;
    EXPECT_EQ(validator.accept(one), FrameVerdict::bad_quaternion) << norm;
  }
  MocapFrame nearly = frame(number++);
  nearly.body[0].orientation.coeffs() *= 1.019;
  EXPECT_EQ(validator.accept(nearly), FrameVerdict::accepted);
  MocapFrame other = frame(number++);
  other.segments = 2;
  EXPECT_EQ(validator.accept(other), FrameVerdict::wrong_size);
  EXPECT_EQ(validator.counters().not_finite, 6);
  EXPECT_EQ(validator.counters().bad_quaternion, 4);
  EXPECT_EQ(validator.counters().wrong_size, 1);
  EXPECT_EQ(validator.counters().accepted, 2);
  EXPECT_EQ(validator.counters().missing, 0) << "a refused frame has arrived";
}

TEST_F(Validator, RejectsLengthsNoBendExplains) {
  ASSERT_EQ(validator.accept(frame(1)), FrameVerdict::accepted);
  MocapFrame far = frame(2);
  far.body[3].position_m += Eigen::Vector3d(0.2, 0.0, 0.0);
  EXPECT_EQ(validator.accept(far), FrameVerdict::bad_length);
  MocapFrame absurd = frame(3);
  absurd.body[3].position_m.setConstant(1e308);
  EXPECT_EQ(validator.accept(absurd), FrameVerdict::bad_length);
  // Both ends in one place, as a frozen or doubled body would be: short without a bend.
  MocapFrame doubled = frame(4);
  doubled.body[2] = doubled.body[1];
  EXPECT_EQ(validator.accept(doubled), FrameVerdict::bad_length);
}

// Two bodies that changed places, for many shapes of the arm: never accepted.
TEST_F(Validator, RejectsSwappedBodies) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> bend(-0.8, 0.8);
  std::int64_t number = 0;
  for (int k = 0; k < 200; ++k) {
    validator.reset();
    for (double& each : u) each = bend(random);
    ASSERT_EQ(validator.accept(frame(++number)), FrameVerdict::accepted);
    for (std::size_t a = 0; a <= 3; ++a) {
      for (std::size_t b = a + 1; b <= 3; ++b) {
        MocapFrame swapped = frame(++number);
        std::swap(swapped.body[a], swapped.body[b]);
        const FrameVerdict verdict = validator.accept(swapped);
        EXPECT_NE(verdict, FrameVerdict::accepted) << a << " and " << b << ", u " << u.transpose();
      }
    }
  }
}

TEST_F(Validator, RejectsAJumpUntilTheArmCouldHaveGoneThere) {
  ASSERT_EQ(validator.accept(frame(1)), FrameVerdict::accepted);
  u[3] += 1.0;  // at 50 rad/s that takes 20 ms, four frames
  EXPECT_EQ(validator.accept(frame(2)), FrameVerdict::jump);
  EXPECT_EQ(validator.accept(frame(3)), FrameVerdict::jump);
  EXPECT_EQ(validator.accept(frame(6)), FrameVerdict::accepted);
  EXPECT_EQ(validator.counters().jump, 2);
}

TEST_F(Validator, NoiseIsNoJumpHoweverShortTheTime) {
  std::mt19937_64 random(5);
  for (int k = 1; k <= 2000; ++k) {
    MocapFrame noisy = frame(k, k);  // a nanosecond apart
    for (BodyPose& body : noisy.body) body = test::disturbed(body, 0.2e-3, 3.5e-3, random);
    ASSERT_EQ(validator.accept(noisy), FrameVerdict::accepted);
  }
}

TEST_F(Validator, AnUnseenBodyIsNoFaultOfTheFrame) {
  ASSERT_EQ(validator.accept(frame(1)), FrameVerdict::accepted);
  MocapFrame hidden = frame(2);
  hidden.body[3].valid = false;
  hidden.body[3].position_m.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(validator.accept(hidden), FrameVerdict::accepted);
  EXPECT_TRUE(validator.estimate().valid[1]);
  EXPECT_FALSE(validator.estimate().valid[2]);
  // Its last sighting still guards it.
  u[5] += 2.0;
  EXPECT_EQ(validator.accept(frame(3)), FrameVerdict::jump);

  MocapFrame dark = frame(4);
  for (BodyPose& body : dark.body) body.valid = false;
  EXPECT_EQ(validator.accept(dark), FrameVerdict::not_seen);
  EXPECT_EQ(validator.counters().not_seen, 1);
}

TEST_F(Validator, DetectsIdenticalPoses) {
  validator.accept(frame(1));
  EXPECT_EQ(validator.identical_in_row(), 0);
  validator.accept(frame(2));
  validator.accept(frame(3));
  EXPECT_EQ(validator.identical_in_row(), 2);
  MocapFrame moved = frame(4);
  moved.body[1].position_m.x() += 1e-15;
  validator.accept(moved);
  EXPECT_EQ(validator.identical_in_row(), 0);
}

TEST(FrameValidator, InertialSensorsNeedNoPositions) {
  EstimationSettings settings;
  settings.method = CurvatureMethod::orientation;
  const ArmParameters arm = arm_of(2);
  FrameValidator validator(settings, arm, test::fixed_base_noise(settings, 2));
  MocapFrame frame = frame_of(arm, Eigen::VectorXd::Constant(4, 0.5));
  for (BodyPose& body : frame.body) body.position_m.setZero();
  EXPECT_EQ(validator.accept(frame), FrameVerdict::accepted);
}

TEST(FrameValidator, RefusesWrongTolerances) {
  for (int k = 0; k < 3; ++k) {
    EstimationSettings settings;
    double* const tolerance[] = {&settings.quaternion_tolerance, &settings.length_tolerance,
                                 &settings.max_speed_radps};
    *tolerance[k] = k == 1 ? std::numeric_limits<double>::quiet_NaN() : 0.0;
    EXPECT_THROW(FrameValidator(settings, arm_of(1), test::fixed_base_noise(settings, 1)),
                 std::invalid_argument);
  }
}

TEST(FrameValidator, EveryVerdictIsCountedUnderItsName) {
  const EstimationSettings settings;
  const ArmParameters arm = arm_of(1);
  FrameValidator validator(settings, arm, test::fixed_base_noise(settings, 1));
  MocapFrame frame = frame_of(arm, Eigen::Vector2d(0.1, 0.2));
  EXPECT_EQ(validator.accept(frame), FrameVerdict::accepted);
  EXPECT_EQ(validator.accept(frame), FrameVerdict::repeated);
  frame.segments = 2;
  EXPECT_EQ(validator.accept(frame), FrameVerdict::wrong_size);
  frame = frame_of(arm, Eigen::Vector2d(0.1, 0.2));
  ++frame.frame_number;
  frame.capture_ns += 5'000'000;
  frame.body[1].orientation.coeffs() *= 2.0;
  EXPECT_EQ(validator.accept(frame), FrameVerdict::bad_quaternion);
  const FrameCounters& counters = validator.counters();
  EXPECT_EQ(counters.accepted, 1);
  EXPECT_EQ(counters.repeated, 1);
  EXPECT_EQ(counters.wrong_size, 1);
  EXPECT_EQ(counters.bad_quaternion, 1);
  EXPECT_EQ(counters.rejected(), 2);
}

}  // namespace
}  // namespace softarm
