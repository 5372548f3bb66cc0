// Foreign motion capture -> frames: numbers by homogeneous matrices, packets by LCM's encoder.
#include "softarm/transport/mocap_source.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <softarm_messages/mocap_frame_t.hpp>
#include <softarm_messages/optitrack_frame_t.hpp>
#include <softarm_messages/rigid_transform_t.hpp>

#include "counted_malloc.hpp"
#include "softarm/transport/settings.hpp"
#include "unit/transport/messages.hpp"

namespace softarm {
namespace {

using namespace softarm_messages;
using test::Bytes;
using test::encoded;

Eigen::Isometry3d random_pose(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                      .normalized()
                      .toRotationMatrix();
  pose.translation() = Eigen::Vector3d(normal(random), normal(random), normal(random));
  return pose;
}

/// Y up, millimetres, x y z w, and a marker frame on every body.
TransportSettings foreign(const char* source, std::mt19937& random) {
  TransportSettings transport;
  transport.mocap = {.source = *mocap_sources().find(source),
                     .unit = LengthUnit::millimetre,
                     .quaternion = QuaternionOrder::xyzw,
                     .axes = Eigen::Matrix3d::Identity()};
  transport.mocap.axes << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  transport.lcm.mocap_channel = "LAB";
  transport.bodies = {.base_id = 10, .segment_ids = {30, 20}};
  const auto marker_frame = [&](const std::string& name) {
    MarkerFrameSettings out;
    out.name = name;
    const Eigen::AngleAxisd turn(random_pose(random).linear());
    out.rotation_rad = turn.angle() * turn.axis();
    out.position_m = random_pose(random).translation();
    return out;
  };
  transport.bodies.base_marker_frame = marker_frame("base");
  transport.bodies.segment_marker_frames = {marker_frame("middle"), marker_frame("tip")};
  return transport;
}

ArmParameters two_segments() {
  ArmParameters arm;
  arm.segments.resize(2);
  arm.base_position_m = {7, 8, 9};
  return arm;
}

/// What that source would send of S_i at `pose`, by matrices: sent = A^-1 S_i frame^-1.
Eigen::Isometry3d sent(const Eigen::Isometry3d& pose, const MarkerFrameSettings& marker_frame,
                       const Eigen::Matrix3d& axes) {
  Eigen::Isometry3d on_body = Eigen::Isometry3d::Identity();
  on_body.linear() =
      Eigen::AngleAxisd(marker_frame.rotation_rad.norm(), marker_frame.rotation_rad.normalized())
          .matrix();
  on_body.translation() = marker_frame.position_m;
  Eigen::Isometry3d world = Eigen::Isometry3d::Identity();
  world.linear() = axes;
  return world.inverse() * pose * on_body.inverse();
}

template <class Number>
void write(const Eigen::Isometry3d& sent, Number* position_mm, Number* xyzw) {
  const Eigen::Quaterniond q(sent.linear());
  for (int k = 0; k < 3; ++k) position_mm[k] = static_cast<Number>(1e3 * sent.translation()[k]);
  for (int k = 0; k < 4; ++k) xyzw[k] = static_cast<Number>(q.coeffs()[k]);
}

void expect_pose(const BodyPose& pose, const Eigen::Isometry3d& truth, double tolerance) {
  EXPECT_TRUE(pose.valid);
  EXPECT_LT((pose.position_m - truth.translation()).norm(), tolerance);
  EXPECT_LT((pose.orientation.toRotationMatrix() - truth.linear()).norm(), tolerance);
}

/// A sender on a clock of 15.6 ms grain, or on one that stands still: frames keep apart in time.
TEST(MocapSource, WhereStampsRepeatArrivalsCount) {
  for (const std::int64_t grain_us : {15'625LL, 1'000'000'000LL}) {
    std::mt19937 random(3);
    const TransportSettings transport = foreign("softarm", random);
    SafetySettings safety;
    safety.frame_latency_s = 0.002;
    MocapSource source(transport, safety, two_segments());
    MocapFrame frame;
    std::int64_t before_ns = 0;
    for (std::int64_t k = 0; k < 400; ++k) {
      mocap_frame_t message{};
      message.frame_number = k + 1;
      message.capture_time_us = 5000 * k / grain_us * grain_us;
      const std::int64_t arrival_ns = 1'000'000'000 + 5'000'000 * k;
      ASSERT_EQ(source.take(0, encoded(message), arrival_ns, frame), MocapReceipt::frame);
      if (k > 20) {
        EXPECT_EQ(frame.capture_ns, arrival_ns - 2'000'000) << k;
        EXPECT_GT(frame.capture_ns, before_ns);
      }
      before_ns = frame.capture_ns;
    }
  }
}

/// The same where bodies come one by one: no frame is lost, and none mixes bodies of two frames,
/// whether the base moves at all and although now and then a body is lost.
TEST(MocapSource, WhereStampsOfBodiesRepeatArrivalsSeparateFrames) {
  for (const bool base_moves : {true, false}) {
    std::mt19937 random(3);
    SafetySettings safety;
    safety.frame_latency_s = 0.002;
    TransportSettings transport = foreign("rigid_transform", random);
    transport.bodies.base_marker_frame = {};
    transport.bodies.segment_marker_frames = {{}, {}};
    MocapSource source(transport, safety, two_segments());
    MocapFrame frame;
    int frames = 0, whole = 0;
    for (std::int64_t k = 0; k < 400; ++k) {
      const std::int64_t arrival_ns = 1'000'000'000 + 5'000'000 * k;
      for (std::size_t body = 0; body < 3; ++body) {
        if (k % 50 == 30 && body == static_cast<std::size_t>(k / 50 % 3)) continue;  // lost
        rigid_transform_t message{};
        message.utime = 5000 * k / 15'625 * 15'625;
        message.quat[3] = 1.0;
        message.trans[0] = body > 0 || base_moves ? static_cast<double>(k) : 0.0;
        if (source.take(body, encoded(message), arrival_ns, frame) != MocapReceipt::frame) continue;
        ++frames;
        if (k < 20) continue;
        whole += frame.body[0].valid && frame.body[1].valid && frame.body[2].valid ? 1 : 0;
        EXPECT_EQ(frame.capture_ns, arrival_ns - 2'000'000) << k;
        for (std::size_t i = base_moves ? 0 : 1; i < 3; ++i) {
          if (!frame.body[i].valid) continue;
          EXPECT_NEAR(frame.body[i].position_m.norm(), 1e-3 * static_cast<double>(k), 1e-9) << i;
        }
      }
      if (source.overdue(arrival_ns + 3'000'000, frame)) ++frames;
    }
    EXPECT_GE(frames, 390);
    EXPECT_EQ(whole, 380 - 8);
  }
}

/// A packet that comes twice is no sign of a coarse clock.
TEST(MocapSource, WherePacketsRepeatStampsCount) {
  std::mt19937 random(3);
  const TransportSettings transport = foreign("softarm", random);
  MocapSource source(transport, {}, two_segments());
  MocapFrame frame;
  for (std::int64_t k = 0; k < 400; ++k) {
    mocap_frame_t message{};
    message.frame_number = k / 2 + 1;
    message.capture_time_us = 5000 * (k / 2);
    const std::int64_t late_ns = k % 2 == 0 ? 0 : 2'000'000;
    ASSERT_EQ(
        source.take(0, encoded(message), 1'000'000'000 + 5'000'000 * (k / 2) + late_ns, frame),
        MocapReceipt::frame);
  }
  const std::int64_t exact_ns = frame.capture_ns;
  mocap_frame_t last{};
  last.frame_number = 201;
  last.capture_time_us = 5000 * 200;
  source.take(0, encoded(last), 1'000'000'000 + 5'000'000 * 200 + 3'000'000, frame);
  EXPECT_EQ(frame.capture_ns - exact_ns, 5'000'000) << "by its stamp, however late it comes";
}

TEST(MocapSource, OptitrackFramesBecomePosesOfTheSegmentsEnds) {
  std::mt19937 random(2);
  const TransportSettings transport = foreign("optitrack", random);
  MocapSource source(transport, {}, two_segments());
  ASSERT_EQ(source.channels(), std::vector<std::string>{"LAB"});
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Isometry3d truth[] = {random_pose(random), random_pose(random),
                                       random_pose(random)};
    const MarkerFrameSettings marker_frames[] = {transport.bodies.base_marker_frame,
                                                 transport.bodies.segment_marker_frames[0],
                                                 transport.bodies.segment_marker_frames[1]};
    const int ids[] = {10, 30, 20};
    optitrack_frame_t message{};
    message.utime = 5;
    message.frame = 40 + trial;
    message.timestamp = 100.0 + 0.005 * trial;
    message.num_rigid_bodies = 3;
    message.rigid_bodies.resize(3, optitrack_rigid_body_t{});
    for (std::size_t i = 0; i < 3; ++i) {
      auto& body = message.rigid_bodies[(i + 1) % 3];
      body.id = ids[i];
      body.params = trial == 3 && i == 1 ? 2 : 3;
      write(sent(truth[i], marker_frames[i], transport.mocap.axes), body.xyz, body.quat);
    }
    MocapFrame frame;
    ASSERT_EQ(source.take(0, encoded(message), 1'000'000'000 + 5'000'000 * trial, frame),
              MocapReceipt::frame);
    EXPECT_EQ(frame.frame_number, 40 + trial);
    EXPECT_EQ(frame.segments, 2);
    // The stamps advance with the arrivals; utime, which stands still here, is not looked at.
    EXPECT_NEAR(static_cast<double>(frame.capture_ns - 1'000'000'000 - 5'000'000 * trial), 0.0,
                1000.0);
    for (std::size_t i = 0; i < 3; ++i) {
      if (trial == 3 && i == 1) {
        EXPECT_FALSE(frame.body[i].valid);
      } else {
        expect_pose(frame.body[i], truth[i], 3e-6);  // floats of millimetres
      }
    }
  }
}

TEST(MocapSource, BodiesOnSeparateChannelsBecomeOneFrame) {
  std::mt19937 random(3);
  const TransportSettings transport = foreign("rigid_transform", random);
  MocapSource source(transport, {}, two_segments());
  ASSERT_EQ(source.channels(), (std::vector<std::string>{"LAB_base", "LAB_middle", "LAB_tip"}));
  EXPECT_EQ(source.find("LAB_tip"), 2U);
  EXPECT_EQ(source.find("LAB"), std::nullopt);
  const MarkerFrameSettings marker_frames[] = {transport.bodies.base_marker_frame,
                                               transport.bodies.segment_marker_frames[0],
                                               transport.bodies.segment_marker_frames[1]};
  MocapFrame frame;
  for (int trial = 0; trial < 20; ++trial) {
    const std::int64_t arrival_ns = 1'000'000'000 + 5'000'000 * trial;
    Eigen::Isometry3d truth[3];
    for (std::size_t i = 0; i < 3; ++i) {
      truth[i] = random_pose(random);
      rigid_transform_t message{};
      message.utime = 5000 * trial;
      write(sent(truth[i], marker_frames[i], transport.mocap.axes), message.trans, message.quat);
      if (trial == 7 && i == 1) continue;
      const MocapReceipt receipt = source.take(i, encoded(message), arrival_ns, frame);
      ASSERT_EQ(receipt, i == 2 && trial != 7 ? MocapReceipt::frame : MocapReceipt::nothing);
    }
    if (trial == 7) {
      ASSERT_FALSE(source.overdue(arrival_ns + 1'000'000, frame));
      ASSERT_TRUE(source.overdue(arrival_ns + 3'000'000, frame));
    }
    EXPECT_EQ(frame.frame_number, trial + 1);
    EXPECT_EQ(frame.capture_ns, arrival_ns);
    for (std::size_t i = 0; i < 3; ++i) {
      if (trial == 7 && i == 1) {
        EXPECT_FALSE(frame.body[i].valid);
      } else {
        expect_pose(frame.body[i], truth[i], 1e-12);
      }
    }
  }
}

TEST(MocapSource, AFixedBaseNeedsNoChannel) {
  std::mt19937 random(4);
  TransportSettings transport = foreign("rigid_transform", random);
  transport.bodies.base_id = -1;
  MocapSource source(transport, {}, two_segments());
  ASSERT_EQ(source.channels(), (std::vector<std::string>{"LAB_middle", "LAB_tip"}));
  rigid_transform_t message{};
  message.quat[3] = 1.0;
  MocapFrame frame;
  EXPECT_EQ(source.take(1, encoded(message), 0, frame), MocapReceipt::nothing);
  ASSERT_EQ(source.take(0, encoded(message), 0, frame), MocapReceipt::frame);
  EXPECT_EQ(frame.body[0].position_m, Eigen::Vector3d(7, 8, 9));
  EXPECT_TRUE(frame.body[0].valid && frame.body[1].valid && frame.body[2].valid);
}

TEST(MocapSource, WhatTheAdapterSendsItReadsBack) {
  std::mt19937 random(5);
  const TransportSettings transport = foreign("optitrack", random);
  const MocapAdapter adapter(transport.bodies, two_segments(), transport.mocap);
  MocapSource source(transport, {}, two_segments());
  MocapFrame frame, again;
  Eigen::Isometry3d truth[3];
  for (std::size_t i = 0; i < 3; ++i) {
    truth[i] = random_pose(random);
    frame.body[i] = {truth[i].translation(), Eigen::Quaterniond(truth[i].linear()), i != 1};
  }
  const auto sent = std::make_unique<SentFrame>();
  adapter.to_sent(frame, 123'456, *sent);
  const auto format = transport.mocap.source.make();
  const auto bytes = format->encode(*sent);
  optitrack_frame_t message;
  ASSERT_GT(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
  EXPECT_EQ(message.timestamp, 0.123456);
  ASSERT_EQ(source.take(0, bytes, 0, again), MocapReceipt::frame);
  EXPECT_EQ(source.sender_time_us(), 123'456);
  expect_pose(again.body[0], truth[0], 3e-6);
  EXPECT_FALSE(again.body[1].valid);
  expect_pose(again.body[2], truth[2], 3e-6);
  expect_pose(adapter.to_pose(adapter.to_sent(frame.body[2], 2), 2), truth[2], 1e-12);
}

TEST(MocapSource, HostileNumbersStayWithinBounds) {
  std::mt19937 random(6);
  MocapSource optitrack(foreign("optitrack", random), {}, two_segments());
  MocapSource vicon(foreign("rigid_transform", random), {}, two_segments());
  MocapFrame frame;
  const double kNan = std::nan("");
  for (const double time_s : {1e300, -1e300, HUGE_VAL, -HUGE_VAL, kNan, 0.0}) {
    optitrack_frame_t message{};
    message.timestamp = time_s;
    message.num_rigid_bodies = 1;
    message.rigid_bodies.resize(1, optitrack_rigid_body_t{});
    message.rigid_bodies[0].id = 30;
    message.rigid_bodies[0].params = 1;
    message.rigid_bodies[0].xyz[0] = static_cast<float>(kNan);
    ASSERT_EQ(optitrack.take(0, encoded(message), 1'000'000'000, frame), MocapReceipt::frame);
    EXPECT_LE(frame.capture_ns, 1'000'000'000);
    EXPECT_TRUE(frame.body[1].valid && std::isnan(frame.body[1].position_m.x()))
        << "the validator judges it";
  }
  TransportSettings transport;
  transport.bodies = {.base_id = -1, .segment_ids = {1, 2}};
  MocapSource own(transport, {}, two_segments());
  for (const std::int64_t time_us : {INT64_MAX, INT64_MIN, INT64_MIN + 1}) {
    mocap_frame_t message{};
    message.capture_time_us = time_us;
    ASSERT_EQ(own.take(0, encoded(message), 1'000'000'000, frame), MocapReceipt::frame);
    EXPECT_EQ(frame.capture_ns, 1'000'000'000);
    EXPECT_LT(std::abs(own.sender_time_us() / 2), INT64_MAX / 1000 / 2) << "in ns it overflows";
  }
  rigid_transform_t message{};
  for (const std::int64_t utime : {INT64_MAX, INT64_MIN, INT64_MIN + 1}) {
    message.utime = utime;
    EXPECT_EQ(vicon.take(0, encoded(message), 0, frame), MocapReceipt::malformed);
  }
  Bytes longer = encoded(rigid_transform_t{});
  longer.push_back({});
  EXPECT_EQ(vicon.take(0, longer, 0, frame), MocapReceipt::malformed);
  EXPECT_EQ(vicon.take(0, {}, 0, frame), MocapReceipt::malformed);
  EXPECT_EQ(vicon.take(99, encoded(rigid_transform_t{}), 0, frame), MocapReceipt::malformed)
      << "no such body";
}

TEST(MocapSource, TakingPacketsAllocatesNothing) {
  std::mt19937 random(7);
  MocapSource optitrack(foreign("optitrack", random), {}, two_segments());
  MocapSource vicon(foreign("rigid_transform", random), {}, two_segments());
  optitrack_frame_t message{};
  message.num_rigid_bodies = 5;
  message.rigid_bodies.resize(5, optitrack_rigid_body_t{});
  const Bytes one = encoded(message), other = encoded(rigid_transform_t{});
  MocapFrame frame;
  const long before = test::thread_allocations;
  for (int k = 0; k < 100; ++k) {
    optitrack.take(0, one, k, frame);
    vicon.take(static_cast<std::size_t>(k % 3), other, k, frame);
    vicon.overdue(k, frame);
  }
  EXPECT_EQ(test::thread_allocations, before);
}

}  // namespace
}  // namespace softarm
