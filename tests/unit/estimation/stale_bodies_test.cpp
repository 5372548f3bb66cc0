// A body that repeats an old pose is found, one by one; a body that has a reason to repeat is not.
#include "softarm/estimation/stale_bodies.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "frames.hpp"
#include "softarm/estimation/frame_validator.hpp"

namespace softarm {
namespace {

using std::numbers::pi;
using test::arm_of;
using test::frame_of;

constexpr std::int64_t kPeriod_ns = 5'000'000;
constexpr int kSegments = 3;

class StaleBody : public testing::Test {
 protected:
  /// The next frame of the arm at `u`, with noise (of the declared size times `noise`).
  MocapFrame next(double noise) {
    MocapFrame frame = frame_of(arm, u, test::some_base());
    frame.frame_number = ++number;
    frame.capture_ns = number * kPeriod_ns;
    for (std::size_t b = noise_on_base ? 0 : 1; b <= kSegments && noise > 0.0; ++b)
      frame.body[b] = test::disturbed(frame.body[b], noise * settings.position_noise_m,
                                      noise * settings.orientation_noise_rad, random);
    return frame;
  }
  bool any_stale(const StaleBodies& bodies) const {
    for (std::size_t b = 0; b <= kSegments; ++b)
      if (bodies.stale(b)) return true;
    return false;
  }
  void swing(int k) {
    for (Eigen::Index i = 0; i < u.size(); ++i)
      u[i] = 0.4 * std::sin(0.01 * k + 0.9 * static_cast<double>(i));
  }

  ArmParameters arm = arm_of(kSegments);
  EstimationSettings settings;
  Eigen::VectorXd u = Eigen::VectorXd::Constant(2 * kSegments, 0.2);
  std::mt19937_64 random{7};
  std::int64_t number = 0;
  bool noise_on_base = true;
};

// Whether the arm moves or rests, with the declared noise.
TEST_F(StaleBody, EveryFrozenSegmentEndIsFoundWithinTwentyFrames) {
  for (const bool moves : {false, true}) {
    for (std::size_t frozen = 1; frozen <= kSegments; ++frozen) {
      SCOPED_TRACE(testing::Message() << "body " << frozen << ", moves " << moves);
      StaleBodies bodies(settings, kSegments);
      MocapFrame last;
      for (int k = 0; k < 200; ++k) {
        if (moves) swing(k);
        last = next(1.0);
        bodies.observe(last, {});
        ASSERT_FALSE(any_stale(bodies));
      }
      for (int k = 200; k < 300; ++k) {
        if (moves) swing(k);
        MocapFrame frame = next(1.0);
        frame.body[frozen] = last.body[frozen];
        bodies.observe(frame, {});
        if (k < 204) {
          ASSERT_FALSE(bodies.stale(frozen)) << k;
        }
        if (k >= 220) {
          ASSERT_TRUE(bodies.stale(frozen)) << k;
        }
        for (std::size_t b = 0; b <= kSegments; ++b) {
          if (b != frozen) {
            ASSERT_FALSE(bodies.stale(b)) << b;
          }
        }
      }
      bodies.observe(next(1.0), {});
      EXPECT_FALSE(any_stale(bodies)) << "it was seen again";
    }
  }
}

TEST_F(StaleBody, SeveralAtOnceAreFoundTooWhateverIsSentBetween) {
  StaleBodies bodies(settings, kSegments);
  MocapFrame last = next(1.0);
  bodies.observe(last, {});
  for (int k = 0; k < 60; ++k) {
    MocapFrame frame = next(1.0);
    frame.body[2] = last.body[2];
    frame.body[3] = last.body[3];
    frame.body[3].valid = k % 2 == 0;  // sometimes admitted
    bodies.observe(frame, {});
  }
  EXPECT_TRUE(bodies.stale(2));
  EXPECT_TRUE(bodies.stale(3));
  EXPECT_FALSE(bodies.stale(1));
}

TEST_F(StaleBody, ABaseMayStandStill) {
  noise_on_base = false;
  StaleBodies bodies(settings, kSegments);
  for (int k = 0; k < 1000; ++k) {
    swing(k);
    bodies.observe(next(1.0), {});
    ASSERT_FALSE(any_stale(bodies)) << k;
  }
}

// Without noise the segment ends stop one after the other, each at its last bit.
TEST_F(StaleBody, AnExactArmThatComesToRestIsNotStale) {
  for (const bool planar : {false, true}) {
    StaleBodies bodies(settings, kSegments);
    if (planar)
      for (Eigen::Index i = 1; i < u.size(); i += 2) u[i] = 0.0;
    for (int k = 0; k < 3000; ++k) {
      for (Eigen::Index i = 0; i < u.size(); ++i) u[i] *= 0.97 + 0.002 * static_cast<double>(i);
      bodies.observe(next(0.0), {});
      ASSERT_FALSE(any_stale(bodies)) << k;
    }
  }
}

// An exact sender whose first segment is stiff: what it carries moves, what carries it does not.
TEST_F(StaleBody, AnExactSegmentThatIsNotCarriedMayStandStill) {
  noise_on_base = false;
  StaleBodies bodies(settings, kSegments);
  for (int k = 0; k < 1000; ++k) {
    u.tail(4).setConstant(0.4 * std::sin(0.02 * k));
    bodies.observe(next(0.0), {});
    ASSERT_FALSE(any_stale(bodies)) << k;
  }
}

// A sender that is faster than its cameras: whole frames repeat, a body every other time.
TEST_F(StaleBody, RepeatedFramesAreNotStaleBodies) {
  StaleBodies bodies(settings, kSegments);
  MocapFrame sent = next(1.0);
  for (int k = 0; k < 1000; ++k) {
    const MocapFrame now = next(1.0);
    if (k % 4 == 0) sent.body = now.body;
    if (k % 2 == 0) sent.body[2] = now.body[2];
    sent.frame_number = now.frame_number;
    sent.capture_ns = now.capture_ns;
    bodies.observe(sent, {});
    ASSERT_FALSE(any_stale(bodies)) << k;
  }
}

// A fixed exact base shows no noise: then the commands decide.
TEST_F(StaleBody, WithoutNoiseTheCommandsDecide) {
  noise_on_base = false;
  constexpr int kFrozenFrames = 50;
  for (const bool commanded : {false, true}) {
    StaleBodies bodies(settings, kSegments);
    std::vector<std::int64_t> began_ns(kSegments, kNever);
    const std::int64_t start = number;
    const auto first_end = next(0.0).body[1];
    std::int64_t found = 0;
    for (int k = 0; k < 300; ++k) {
      u.tail(4).setConstant(0.4 * std::sin(0.02 * k));
      MocapFrame frame = next(0.0);
      frame.body[1] = first_end;
      if (commanded && k == 20) std::fill(began_ns.begin(), began_ns.end(), frame.capture_ns);
      bodies.observe(frame, {began_ns, kFrozenFrames});
      if (bodies.stale(1) && found == 0) found = number - start;
      ASSERT_FALSE(bodies.stale(2) || bodies.stale(3));
    }
    EXPECT_EQ(found > 0, commanded);
    if (commanded) {
      EXPECT_NEAR(static_cast<double>(found), 2.0 * kFrozenFrames, 5.0);
    }
    // All of them, and the base: a frozen sensor or an arm at rest.
    StaleBodies all(settings, kSegments);
    MocapFrame frame = next(0.0);
    for (int k = 0; k < 300; ++k) {
      frame.capture_ns += kPeriod_ns;
      all.observe(frame, {began_ns, kFrozenFrames});
      ASSERT_FALSE(any_stale(all));
    }
  }
}

TEST_F(StaleBody, LeavesItsSegmentsUnobservedAndIsCounted) {
  FrameValidator validator(settings, arm, body_noise(settings, kSegments));
  MocapFrame last = next(1.0);
  for (int k = 0; k < 50; ++k)
    ASSERT_EQ(validator.accept(last = next(1.0)), FrameVerdict::accepted);
  for (int k = 0; k < 50; ++k) {
    MocapFrame frame = next(1.0);
    frame.body[2] = last.body[2];
    ASSERT_EQ(validator.accept(frame), FrameVerdict::accepted);
  }
  EXPECT_TRUE(validator.estimate().valid[0]);
  EXPECT_FALSE(validator.estimate().valid[1]);
  EXPECT_FALSE(validator.estimate().valid[2]);
  EXPECT_TRUE(validator.newest().body[1].valid);
  EXPECT_FALSE(validator.newest().body[2].valid);
  EXPECT_GT(validator.counters().stale, 30);
  // Nothing is left of an arm of one segment.
  const ArmParameters one = arm_of(1);
  FrameValidator short_validator(settings, one, body_noise(settings, 1));
  BodyPose end;
  for (int k = 0; k < 100; ++k) {
    MocapFrame frame = next(1.0);
    frame.segments = 1;
    if (k == 50) end = frame.body[1];
    if (k > 50) frame.body[1] = end;
    const FrameVerdict verdict = short_validator.accept(frame);
    if (k > 80) {
      ASSERT_EQ(verdict, FrameVerdict::not_seen);
    }
  }
}

// About its own axis, by what symmetric marker sets allow, at any bend; before anything was seen.
TEST_F(StaleBody, ATurnedBodyIsRejectedAtAnyBend) {
  for (const double turn : {pi / 4, pi / 3, pi / 2, 2 * pi / 3, pi, -pi / 2}) {
    for (const double theta : {0.0, 0.4, 1.5, 2.5, 3.1}) {
      for (std::size_t b = 0; b <= kSegments; ++b) {
        FrameValidator validator(settings, arm, body_noise(settings, kSegments));
        for (Eigen::Index i = 0; i < u.size(); i += 2) u.segment<2>(i) << 0.6 * theta, 0.8 * theta;
        MocapFrame frame = next(0.0);
        ASSERT_EQ(FrameValidator(settings, arm, body_noise(settings, kSegments)).accept(frame),
                  FrameVerdict::accepted);
        frame.body[b].orientation =
            frame.body[b].orientation * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ());
        EXPECT_NE(validator.accept(frame), FrameVerdict::accepted)
            << "body " << b << " by " << turn << " at " << theta;
        frame.frame_number = ++number;
        frame.capture_ns += kPeriod_ns;
        const FrameVerdict verdict = validator.accept(frame);
        if (theta < 2.0 && b == kSegments) {
          EXPECT_EQ(verdict, FrameVerdict::bad_torsion) << turn << " " << theta;
        }
      }
    }
  }
}

}  // namespace
}  // namespace softarm
