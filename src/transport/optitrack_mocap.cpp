// OptiTrack's frame as it comes over LCM -> the little of it that is used. The type has eight
// lists, lists within lists and texts, all of which LCM's own decoder would allocate as the bytes
// say.
#include <cmath>
#include <softarm_messages/optitrack_frame_t.hpp>

#include "softarm/base/time.hpp"
#include "transport/byte_cursor.hpp"
#include "transport/lcm_mocap_format.hpp"

namespace softarm {
namespace {

/// Length, which counts the terminating zero, and characters.
void skip_text(BigEndianCursor& cursor) {
  const auto text = cursor.take_bytes(cursor.count(1));
  if (text.empty() || text.back() != std::byte{0}) cursor.fail();
}

constexpr std::size_t kPosition = 3 * 4;
constexpr std::size_t kLeastMarkerSet = 4 + 1 + 4;
constexpr std::size_t kLeastRigidBody = 4 + kPosition + 4 * 4 + 4 + 4 + 2;
constexpr std::size_t kMarkerOfBody = kPosition + 4 + 4;
constexpr std::size_t kLeastBodies = 4 + 4;
constexpr std::size_t kMarker = 4 + kPosition + 4 + 2;
constexpr std::size_t kForceplate = 4 + 2 * kPosition;

SentBody take_rigid_body(BigEndianCursor& cursor) {
  SentBody body;
  body.id = cursor.take<std::int32_t>();
  for (double& each : body.position) each = static_cast<double>(cursor.take<float>());
  for (double& each : body.orientation) each = static_cast<double>(cursor.take<float>());
  cursor.skip_list(kMarkerOfBody);  // three lists of one length
  cursor.skip(4);                   // mean_error
  body.seen = (cursor.take<std::uint16_t>() & 1U) != 0;
  return body;
}

void skip_marker_sets(BigEndianCursor& cursor) {
  const std::size_t sets = cursor.count(kLeastMarkerSet);
  for (std::size_t i = 0; i < sets && cursor.ok(); ++i) {
    skip_text(cursor);
    cursor.skip_list(kPosition);
  }
}

void skip_skeletons(BigEndianCursor& cursor) {
  const std::size_t skeletons = cursor.count(kLeastBodies);
  for (std::size_t i = 0; i < skeletons && cursor.ok(); ++i) {
    cursor.skip(4);
    const std::size_t bodies = cursor.count(kLeastRigidBody);
    for (std::size_t j = 0; j < bodies && cursor.ok(); ++j) take_rigid_body(cursor);
  }
}

class OptitrackFormat final : public LcmMocapFormat<softarm_messages::optitrack_frame_t> {
 public:
  bool decode(std::span<const std::byte> bytes, SentFrame& frame) noexcept override {
    BigEndianCursor cursor(bytes);
    if (cursor.take<std::int64_t>() != softarm_messages::optitrack_frame_t::getHash()) return false;
    cursor.skip(8);  // utime, the sender's wall clock
    frame.frame_number = cursor.take<std::int32_t>();
    skip_marker_sets(cursor);
    cursor.skip_list(kPosition);  // markers of no body
    frame.bodies = cursor.count(kLeastRigidBody);
    if (frame.bodies > SentFrame::kMostBodies) return false;
    for (std::size_t i = 0; i < frame.bodies && cursor.ok(); ++i)
      frame.body[i] = take_rigid_body(cursor);
    skip_skeletons(cursor);
    cursor.skip_list(kMarker);
    cursor.skip_list(kForceplate);
    cursor.skip(4 + 8 + 8);                               // latency and timecode
    frame.sender_time_us = to_us(cursor.take<double>());  // the cameras' own clock
    cursor.skip(2);                                       // params
    return cursor.at_end();
  }

  std::span<const std::byte> encode(const SentFrame& frame) override {
    message_ = {};
    message_.utime = frame.sender_time_us;
    message_.frame = static_cast<std::int32_t>(frame.frame_number);
    message_.timestamp = 1e-6 * static_cast<double>(frame.sender_time_us);
    message_.num_rigid_bodies = static_cast<std::int32_t>(frame.bodies);
    for (const SentBody& from : std::span(frame.body).first(frame.bodies)) {
      auto& body = message_.rigid_bodies.emplace_back();
      body.id = from.id;
      body.params = from.seen ? 1 : 0;
      for (std::size_t k = 0; k < 3; ++k) body.xyz[k] = static_cast<float>(from.position[k]);
      for (std::size_t k = 0; k < 4; ++k) body.quat[k] = static_cast<float>(from.orientation[k]);
    }
    return encoded();
  }
};

}  // namespace

MocapSourceKind optitrack_mocap() {
  return {.label = "optitrack",
          .make = made<MocapFormat, OptitrackFormat>,
          .channel = "OPTITRACK_FRAMES",
          .quaternion = QuaternionOrder::xyzw};
}

}  // namespace softarm
