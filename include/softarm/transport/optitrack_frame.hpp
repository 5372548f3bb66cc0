// OptiTrack's frame as it comes over LCM -> the little of it that is used. The type has eight
// lists, lists within lists and texts, all of which LCM's own decoder would allocate as the bytes
// tell it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace softarm {

/// A rigid body as sent: the sender's world, unit and order of the quaternion.
struct OptitrackBody {
  std::int32_t id = 0;
  bool tracked = false;  ///< bit 0 of params
  std::array<float, 3> position{};
  std::array<float, 4> orientation{};
};

/// What is kept of an optitrack_frame_t.
struct OptitrackFrame {
  static constexpr std::size_t kMostBodies = 512;

  std::int64_t utime_us = 0;  ///< sender's wall clock
  std::int32_t frame_number = 0;
  double timestamp_s = 0.0;  ///< the cameras' own clock
  std::size_t bodies = 0;
  std::array<OptitrackBody, kMostBodies> body;
};

/// False, and `frame` unspecified, unless `bytes` are exactly one optitrack_frame_t with at most
/// kMostBodies rigid bodies. Every length is held against the bytes that are left before it is
/// walked; nothing is allocated, and time grows with bytes.size() only. Values are not judged.
bool decode(std::span<const std::byte> bytes, OptitrackFrame& frame) noexcept;

}  // namespace softarm
