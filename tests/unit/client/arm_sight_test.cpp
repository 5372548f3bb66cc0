// Frames to bend and speed, against arcs drawn by hand.
#include "client/arm_sight.hpp"

#include <gtest/gtest.h>

#include "milliseconds.hpp"
#include "softarm/config/load.hpp"
#include "unit/client/arcs.hpp"

namespace softarm {
namespace {

using test::kMs;

class Sight : public ::testing::Test {
 protected:
  void show(double bend_rad, std::int64_t time_ns, bool valid = true) {
    MocapFrame frame = test::bent_arm(experiment.arm, bend_rad);
    frame.frame_number = ++number;
    frame.capture_ns = time_ns;
    frame.body[1].valid = valid;
    sight.take(frame, time_ns + 5 * kMs);
  }

  Experiment experiment = load_experiment(SOFTARM_SOURCE_DIR "/config/one_segment.yaml");
  ArmSight sight{experiment};
  std::int64_t number = 0;
};

TEST_F(Sight, SeesNothingBeforeTheFirstWholeFrame) {
  EXPECT_EQ(sight.seen().arrival_ns, kNever);
  show(0.3, 100 * kMs, false);
  EXPECT_EQ(sight.seen().arrival_ns, kNever);
  EXPECT_EQ(sight.seen().u_rad.size(), 0);
  show(0.3, 110 * kMs);
  EXPECT_EQ(sight.seen().capture_ns, 110 * kMs);
  EXPECT_EQ(sight.seen().arrival_ns, 115 * kMs);
  EXPECT_NEAR(sight.seen().u_rad[0], 0.3, 1e-9);
  EXPECT_NEAR(sight.seen().u_rad[1], 0.0, 1e-9);
  EXPECT_NEAR(sight.seen().bend_rad, 0.3, 1e-9);
  EXPECT_EQ(sight.seen().speed_radps, 0.0) << "one frame is no motion";
}

TEST_F(Sight, MeasuresSpeedOverFiftyMillisecondsAtLeast) {
  for (int k = 0; k <= 100; ++k) show(0.1 + 0.002 * k, 1000 * kMs + 5 * k * kMs);
  EXPECT_NEAR(sight.seen().speed_radps, 0.4, 1e-6);
  // Frames that a stall delivers at once.
  ArmSight at_once(experiment);
  for (int k = 0; k < 20; ++k) {
    MocapFrame frame = test::bent_arm(experiment.arm, 0.1 * k);
    frame.frame_number = k;
    frame.capture_ns = (k + 1) * kMs;
    at_once.take(frame, 500 * kMs);
  }
  EXPECT_EQ(at_once.seen().speed_radps, 0.0);
}

TEST_F(Sight, ARepeatedFrameAndOneFromBeforeShowNothing) {
  show(0.3, 100 * kMs);
  MocapFrame frame = test::bent_arm(experiment.arm, 0.5);
  frame.frame_number = number;
  frame.capture_ns = 110 * kMs;
  sight.take(frame, 115 * kMs);
  EXPECT_NEAR(sight.seen().bend_rad, 0.3, 1e-9) << "the number of the frame before";
  frame.frame_number = number + 1;
  frame.capture_ns = 100 * kMs;
  sight.take(frame, 120 * kMs);
  EXPECT_NEAR(sight.seen().bend_rad, 0.3, 1e-9) << "captured at the same time";
  EXPECT_EQ(sight.seen().arrival_ns, 105 * kMs);
}

}  // namespace
}  // namespace softarm
