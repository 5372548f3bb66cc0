// OptiTrack's frame as it comes over LCM -> the little of it that is used. The type has eight
// lists, lists within lists and texts, all of which LCM's own decoder would allocate as the bytes
// say.
#include <bit>
#include <cmath>
#include <softarm_messages/optitrack_frame_t.hpp>
#include <type_traits>

#include "softarm/base/time.hpp"
#include "transport/lcm_mocap_format.hpp"

namespace softarm {
namespace {

/// Walks big-endian numbers. Once something did not fit, all that follows is zero and `ok` false.
class Cursor {
 public:
  explicit Cursor(std::span<const std::byte> bytes) : left_(bytes) {}

  bool ok() const { return ok_; }
  bool at_end() const { return ok_ && left_.empty(); }

  void skip(std::size_t size) {
    if (size > left_.size()) {
      ok_ = false;
      left_ = {};
      return;
    }
    left_ = left_.subspan(size);
  }

  template <class Number>
  Number take() {
    using Bits =
        std::conditional_t<sizeof(Number) == 8, std::uint64_t,
                           std::conditional_t<sizeof(Number) == 4, std::uint32_t, std::uint16_t>>;
    const auto from = left_;
    skip(sizeof(Number));
    if (!ok_) return Number{};
    Bits bits = 0;
    for (std::size_t k = 0; k < sizeof(Number); ++k)
      bits = static_cast<Bits>(bits << 8 | std::to_integer<Bits>(from[k]));
    return std::bit_cast<Number>(bits);
  }

  /// A number of elements of at least `element` bytes each: no more than can still come.
  std::size_t count(std::size_t element) {
    const auto size = take<std::int32_t>();
    if (size < 0 || static_cast<std::size_t>(size) > left_.size() / element) ok_ = false;
    if (ok_) return static_cast<std::size_t>(size);
    left_ = {};
    return 0;
  }

  void skip_list(std::size_t element) { skip(element * count(element)); }

  /// Length, which counts the terminating zero, and characters.
  void skip_text() {
    const std::size_t length = count(1);
    if (length == 0 || left_.size() < length || left_[length - 1] != std::byte{0}) ok_ = false;
    skip(length);
  }

 private:
  std::span<const std::byte> left_;
  bool ok_ = true;
};

constexpr std::size_t kPoint = 3 * 4;
constexpr std::size_t kLeastMarkerSet = 4 + 1 + 4;
constexpr std::size_t kLeastRigidBody = 4 + kPoint + 4 * 4 + 4 + 4 + 2;
constexpr std::size_t kMarkerOfBody = kPoint + 4 + 4;
constexpr std::size_t kLeastSkeleton = 4 + 4;
constexpr std::size_t kMarker = 4 + kPoint + 4 + 2;
constexpr std::size_t kForceplate = 4 + 2 * kPoint;

SentBody take_body(Cursor& cursor) {
  SentBody body;
  body.id = cursor.take<std::int32_t>();
  for (double& each : body.position) each = static_cast<double>(cursor.take<float>());
  for (double& each : body.orientation) each = static_cast<double>(cursor.take<float>());
  cursor.skip_list(kMarkerOfBody);  // three lists of one length
  cursor.skip(4);                   // mean_error
  body.seen = (cursor.take<std::uint16_t>() & 1U) != 0;
  return body;
}

void skip_marker_sets(Cursor& cursor) {
  const std::size_t sets = cursor.count(kLeastMarkerSet);
  for (std::size_t i = 0; i < sets && cursor.ok(); ++i) {
    cursor.skip_text();
    cursor.skip_list(kPoint);
  }
}

void skip_skeletons(Cursor& cursor) {
  const std::size_t skeletons = cursor.count(kLeastSkeleton);
  for (std::size_t i = 0; i < skeletons && cursor.ok(); ++i) {
    cursor.skip(4);
    const std::size_t bodies = cursor.count(kLeastRigidBody);
    for (std::size_t j = 0; j < bodies && cursor.ok(); ++j) take_body(cursor);
  }
}

/// What no clock relation takes where the time is nonsense.
std::int64_t to_us(double time_s) noexcept {
  const double time_us = 1e6 * time_s;
  return std::abs(time_us) <= static_cast<double>(kLatest_us) ? std::llround(time_us)
                                                              : kLatest_us + 1;
}

class OptitrackFormat final : public LcmMocapFormat<softarm_messages::optitrack_frame_t> {
 public:
  bool decode(std::span<const std::byte> bytes, SentFrame& frame) noexcept override {
    Cursor cursor(bytes);
    if (cursor.take<std::int64_t>() != softarm_messages::optitrack_frame_t::getHash()) return false;
    cursor.skip(8);  // utime, the sender's wall clock
    frame.frame_number = cursor.take<std::int32_t>();
    skip_marker_sets(cursor);
    cursor.skip_list(kPoint);  // markers of no body
    frame.bodies = cursor.count(kLeastRigidBody);
    if (frame.bodies > SentFrame::kMostBodies) return false;
    for (std::size_t i = 0; i < frame.bodies && cursor.ok(); ++i) frame.body[i] = take_body(cursor);
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
  return {
      .label = "optitrack",
      .make = []() -> std::unique_ptr<MocapFormat> { return std::make_unique<OptitrackFormat>(); },
      .channel = "OPTITRACK_FRAMES",
      .quaternion = QuaternionOrder::xyzw};
}

}  // namespace softarm
