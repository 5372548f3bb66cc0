// OptiTrack's frame, written by LCM's own encoder, read by our walk over the bytes.
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <random>
#include <softarm_messages/optitrack_frame_t.hpp>

#include "counted_malloc.hpp"
#include "softarm/transport/mocap_format.hpp"
#include "unit/transport/messages.hpp"

namespace softarm {
namespace {

using namespace softarm_messages;
using test::Bytes;
using test::encoded;

optitrack_rigid_body_t body(int id, int markers) {
  optitrack_rigid_body_t out{};
  out.id = id;
  for (int k = 0; k < 3; ++k) out.xyz[k] = static_cast<float>(id + 0.25 * k);
  for (int k = 0; k < 4; ++k) out.quat[k] = static_cast<float>(0.5 - 0.125 * k);
  out.num_markers = markers;
  for (int k = 0; k < markers; ++k) {
    out.marker_xyz.push_back({1.0F, 2.0F, 3.0F});
    out.marker_ids.push_back(k);
    out.marker_sizes.push_back(0.01F);
  }
  out.params = static_cast<std::int16_t>(id % 2 == 0 ? 1 : 6);
  return out;
}

/// With something in every list, and lists within lists.
optitrack_frame_t full_frame() {
  optitrack_frame_t frame{};
  frame.utime = 1'700'000'000'000'000;
  frame.frame = 4711;
  for (const char* name : {"arm", "", "a longer name"}) {
    optitrack_marker_set_t set{};
    set.name = name;
    set.num_markers = static_cast<int>(set.name.size() % 4);
    set.xyz.assign(static_cast<std::size_t>(set.num_markers), {1.0F, 2.0F, 3.0F});
    frame.marker_sets.push_back(set);
  }
  frame.num_marker_sets = 3;
  frame.other_markers.assign(2, {1.0F, 2.0F, 3.0F});
  frame.num_other_markers = 2;
  frame.rigid_bodies = {body(7, 3), body(2, 0), body(-9, 5)};
  frame.num_rigid_bodies = 3;
  optitrack_skeleton_t skeleton{};
  skeleton.rigid_bodies = {body(1, 1), body(2, 2)};
  skeleton.num_rigid_bodies = 2;
  frame.skeletons = {skeleton, optitrack_skeleton_t{}};
  frame.num_skeletons = 2;
  frame.labeled_markers.resize(4, optitrack_marker_t{});
  frame.num_labeled_markers = 4;
  frame.forceplates.resize(1, optitrack_forceplate_t{});
  frame.num_forceplates = 1;
  frame.latency = 0.25F;
  frame.timestamp = 12.5;
  frame.params = -1;
  return frame;
}

class OptitrackDecoding : public ::testing::Test {
 protected:
  /// On the heap and no longer than it is, so that a sanitizer sees a read beyond it.
  bool accepts(const Bytes& bytes) {
    const Bytes exact(bytes.begin(), bytes.end());
    return format->decode(exact, frame);
  }

  std::unique_ptr<MocapFormat> format = mocap_sources().find("optitrack")->make();
  std::unique_ptr<SentFrame> owned = std::make_unique<SentFrame>();
  SentFrame& frame = *owned;
};

TEST_F(OptitrackDecoding, IsTheTypeThatLaboratoriesPublish) {
  // Computed by lcm-gen from the definitions of RobotLocomotion/optitrack-driver and of bot_core.
  EXPECT_EQ(static_cast<std::uint64_t>(optitrack_frame_t::getHash()), 0x026265ffda8529c1U);
  EXPECT_EQ(static_cast<std::uint64_t>(rigid_transform_t::getHash()), 0xea9ffbf2acc5c5aeU);
}

TEST_F(OptitrackDecoding, FindsTheBodiesBehindEverythingElse) {
  ASSERT_TRUE(accepts(encoded(full_frame())));
  EXPECT_EQ(frame.frame_number, 4711);
  EXPECT_EQ(frame.sender_time_us, 12'500'000) << "the cameras' clock";
  ASSERT_EQ(frame.bodies, 3U);
  const int ids[] = {7, 2, -9};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(frame.body[i].id, ids[i]);
    EXPECT_EQ(frame.body[i].seen, ids[i] == 2) << "bit 0 of params alone";
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(frame.body[i].position[k],
                static_cast<float>(ids[i] + 0.25 * static_cast<double>(k)));
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_EQ(frame.body[i].orientation[k],
                static_cast<float>(0.5 - 0.125 * static_cast<double>(k)));
  }
  EXPECT_TRUE(accepts(encoded(optitrack_frame_t{})));
  EXPECT_EQ(frame.bodies, 0U);
}

TEST_F(OptitrackDecoding, EveryTruncationAndEveryTrailIsRefused) {
  const Bytes whole = encoded(full_frame());
  for (std::size_t length = 0; length < whole.size(); ++length)
    ASSERT_FALSE(accepts({whole.begin(), whole.begin() + static_cast<long>(length)})) << length;
  for (const std::size_t trail : {1U, 2U, 4U, 8U, 1000U}) {
    Bytes longer = whole;
    longer.insert(longer.end(), trail, std::byte{0});
    EXPECT_FALSE(accepts(longer)) << trail;
  }
}

TEST_F(OptitrackDecoding, AnotherHashIsRefused) {
  for (std::size_t bit = 0; bit < 64; ++bit) {
    Bytes other = encoded(full_frame());
    other[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
    EXPECT_FALSE(accepts(other)) << bit;
  }
}

TEST_F(OptitrackDecoding, HostileLengthsAreRefusedWhereverTheyStand) {
  const Bytes whole = encoded(full_frame());
  const auto write = [](Bytes& bytes, std::size_t at, std::uint32_t value) {
    for (std::size_t k = 0; k < 4; ++k)
      bytes[at + k] = static_cast<std::byte>(value >> 8 * (3 - k));
  };
  // The lengths before the bodies, counted by hand: hash 8, utime 8, frame 4; sets: "arm" 3 + 1
  // bytes, 3 markers of 12; "" 1 byte, 0; "a longer name" 13 + 1 bytes, 1 marker.
  const std::size_t sets = 20, name = 24, markers = 32, second = 72, others = 115, bodies = 143,
                    of_body = bodies + 4 + 4 + 12 + 16;
  for (const std::size_t at : {sets, name, markers, second, others, bodies, of_body})
    for (const std::uint32_t length :
         {0xffffffffU, 0x80000000U, 0x7fffffffU, 0x10000000U, 0x00010000U, 0x40000000U}) {
      Bytes other = whole;
      write(other, at, length);
      EXPECT_FALSE(accepts(other)) << at << ": " << length;
    }
  // Anywhere else they may be numbers; nothing may be read beyond the end, nor take long.
  for (std::size_t at = 8; at + 4 <= whole.size(); ++at)
    for (const std::uint32_t value : {0xffffffffU, 0x80000000U, 0x10000000U, 0U, 1U, 4U}) {
      Bytes other = whole;
      write(other, at, value);
      if (accepts(other)) {
        EXPECT_LE(frame.bodies, SentFrame::kMostBodies);
      }
    }
}

TEST_F(OptitrackDecoding, MoreBodiesThanFitAreRefused) {
  optitrack_frame_t many{};
  many.rigid_bodies.assign(SentFrame::kMostBodies, body(1, 0));
  many.num_rigid_bodies = static_cast<int>(many.rigid_bodies.size());
  EXPECT_TRUE(accepts(encoded(many)));
  many.rigid_bodies.push_back(body(1, 0));
  ++many.num_rigid_bodies;
  EXPECT_FALSE(accepts(encoded(many)));
}

TEST_F(OptitrackDecoding, RandomBytesBehindTheRightHashDoNoHarm) {
  std::mt19937 random(3);
  const Bytes whole = encoded(full_frame());
  int accepted = 0;
  for (int trial = 0; trial < 20'000; ++trial) {
    Bytes bytes(8 + random() % 400);
    for (std::size_t k = 0; k < bytes.size(); ++k)
      bytes[k] = k < 8 ? whole[k] : static_cast<std::byte>(random() % 3 == 0 ? random() : 0);
    accepted += accepts(bytes) ? 1 : 0;
  }
  EXPECT_LT(accepted, 20'000);
}

TEST_F(OptitrackDecoding, AllocatesNothing) {
  const Bytes whole = encoded(full_frame());
  const auto before = test::thread_allocations;
  for (int k = 0; k < 100; ++k) ASSERT_TRUE(format->decode(whole, frame));
  EXPECT_EQ(test::thread_allocations, before);
}

}  // namespace
}  // namespace softarm
