// Rigid bodies by id -> base and segment ends.
#include "softarm/transport/mocap_adapter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/settings.hpp"
#include "softarm/transport/softarm_mocap.hpp"
#include "unit/transport/messages.hpp"

namespace softarm {
namespace {

using softarm_messages::mocap_body_t;
using softarm_messages::mocap_frame_t;

mocap_body_t body(int id, double x, bool valid = true) {
  mocap_body_t result{};
  result.id = id;
  result.valid = valid;
  result.position_m[0] = x;
  result.position_m[1] = x + 1;
  result.position_m[2] = x + 2;
  const Eigen::Quaterniond q(Eigen::AngleAxisd(x, Eigen::Vector3d(1, 2, 3).normalized()));
  result.orientation[0] = q.w();
  result.orientation[1] = q.x();
  result.orientation[2] = q.y();
  result.orientation[3] = q.z();
  return result;
}

mocap_frame_t frame_of(std::vector<mocap_body_t> bodies) {
  mocap_frame_t message{};
  message.frame_number = 12;
  message.capture_time_us = 34;
  message.num_bodies = static_cast<std::int16_t>(bodies.size());
  message.bodies = std::move(bodies);
  return message;
}

/// Holds the pose that body(id, x) describes.
void expect_pose(const BodyPose& pose, double x) {
  EXPECT_TRUE(pose.valid);
  EXPECT_EQ(pose.position_m, Eigen::Vector3d(x, x + 1, x + 2));
  // The rotation itself, not its four numbers: their order is what may go wrong.
  const Eigen::AngleAxisd turn(x, Eigen::Vector3d(1, 2, 3).normalized());
  EXPECT_LT((pose.orientation.toRotationMatrix() - turn.toRotationMatrix()).norm(), 1e-12);
}

ArmParameters three_segments() {
  ArmParameters arm;
  arm.segments.resize(3);
  arm.base_position_m = {7, 8, 9};
  return arm;
}

void to_frame(const MocapAdapter& adapter, const mocap_frame_t& message, MocapFrame& frame) {
  const auto sent = std::make_unique<SentFrame>();
  to_sent(message, *sent);
  adapter.to_frame(*sent, frame);
}

mocap_frame_t message_of(const MocapAdapter& adapter, const MocapFrame& frame,
                         std::int64_t sender_time_us) {
  const auto sent = std::make_unique<SentFrame>();
  adapter.to_sent(frame, sender_time_us, *sent);
  mocap_frame_t message;
  to_message(*sent, message);
  return message;
}

const BodySettings kBodies{.base_id = 10, .segment_ids = {30, 20, -5}};

TEST(MocapAdapter, FindsBodiesInAnyOrderAmongOthers) {
  const MocapAdapter adapter(kBodies, three_segments());
  std::vector<mocap_body_t> bodies{body(10, 0.1), body(30, 0.2), body(20, 0.3), body(-5, 0.4),
                                   body(99, 5.0), body(0, 6.0),  body(-1, 7.0)};
  std::mt19937 random(4);
  for (int k = 0; k < 100; ++k) {
    std::shuffle(bodies.begin(), bodies.end(), random);
    MocapFrame frame;
    to_frame(adapter, frame_of(bodies), frame);
    EXPECT_EQ(frame.frame_number, 12);
    EXPECT_EQ(frame.segments, 3);
    expect_pose(frame.body[0], 0.1);
    expect_pose(frame.body[1], 0.2);
    expect_pose(frame.body[2], 0.3);
    expect_pose(frame.body[3], 0.4);
  }
}

TEST(MocapAdapter, AnAbsentOrInvalidBodyIsNotSeen) {
  const MocapAdapter adapter(kBodies, three_segments());
  MocapFrame frame;
  to_frame(adapter, frame_of({body(10, 0.1), body(30, 0.2), body(20, 0.3), body(-5, 0.4)}), frame);
  // Into the same frame: nothing of the one before may shine through.
  to_frame(adapter, frame_of({body(30, 0.2), body(20, 0.3, false)}), frame);
  EXPECT_FALSE(frame.body[0].valid);
  expect_pose(frame.body[1], 0.2);
  EXPECT_FALSE(frame.body[2].valid);
  EXPECT_FALSE(frame.body[3].valid);
  to_frame(adapter, frame_of({}), frame);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_FALSE(frame.body[i].valid);
}

TEST(MocapAdapter, AFixedBaseIsAlwaysSeen) {
  BodySettings fixed = kBodies;
  fixed.base_id = -1;
  const MocapAdapter adapter(fixed, three_segments());
  MocapFrame frame;
  // A body that happens to carry the id -1 is not the base.
  to_frame(adapter, frame_of({body(-1, 0.7), body(30, 0.2)}), frame);
  EXPECT_TRUE(frame.body[0].valid);
  EXPECT_EQ(frame.body[0].position_m, Eigen::Vector3d(7, 8, 9));
  EXPECT_LT((frame.body[0].orientation.toRotationMatrix() - three_segments().base_rotation).norm(),
            1e-12);
  const mocap_frame_t message = message_of(adapter, frame, 0);
  EXPECT_EQ(message.num_bodies, 3) << "a fixed base is nothing a camera sees";
}

TEST(MocapAdapter, NaNPassesUnchangedToWhoeverJudgesIt) {
  const MocapAdapter adapter(kBodies, three_segments());
  mocap_frame_t message = frame_of({body(10, 0.1), body(30, 0.2)});
  message.bodies[0].position_m[1] = std::nan("");
  message.bodies[1].orientation[2] = std::numeric_limits<double>::infinity();
  MocapFrame frame;
  to_frame(adapter, message, frame);
  EXPECT_TRUE(frame.body[0].valid);
  EXPECT_TRUE(std::isnan(frame.body[0].position_m.y()));
  EXPECT_TRUE(std::isinf(frame.body[1].orientation.y()));
}

TEST(MocapAdapter, TheFirstOfTwoBodiesWithOneIdCounts) {
  const MocapAdapter adapter(kBodies, three_segments());
  MocapFrame frame;
  to_frame(adapter, frame_of({body(30, 0.2), body(30, 0.9)}), frame);
  expect_pose(frame.body[1], 0.2);
}

TEST(MocapAdapter, AFrameSurvivesTheWire) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  const MocapAdapter adapter(kBodies, three_segments());
  for (int k = 0; k < 100; ++k) {
    MocapFrame sent;
    sent.frame_number = k;
    sent.capture_ns = 1'000'000'000 + k;
    sent.segments = 3;
    for (std::size_t i = 0; i < 4; ++i) {
      sent.body[i].position_m = {normal(random), normal(random), normal(random)};
      sent.body[i].orientation =
          Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
              .normalized();
      sent.body[i].valid = random() % 4 != 0;
    }
    const mocap_frame_t message = message_of(adapter, sent, 555);
    EXPECT_EQ(message.capture_time_us, 555);
    mocap_frame_t received;
    ASSERT_TRUE(decode(test::encoded(message), received));
    MocapFrame frame;
    to_frame(adapter, received, frame);
    EXPECT_EQ(frame.frame_number, sent.frame_number);
    EXPECT_EQ(frame.segments, 3);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(frame.body[i].valid, sent.body[i].valid);
      EXPECT_EQ(frame.body[i].position_m, sent.body[i].position_m);
      EXPECT_EQ(frame.body[i].orientation.coeffs(), sent.body[i].orientation.coeffs());
    }
  }
}

}  // namespace
}  // namespace softarm
