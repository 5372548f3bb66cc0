#include "softarm/transport/message_decoding.hpp"

#include <algorithm>
#include <cstdint>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/transport/tick_record.hpp"

namespace softarm {
namespace {

constexpr std::size_t kHash = 8;
constexpr std::size_t kLongestText = 256;             // version or build text, terminator included
constexpr std::size_t kBody = 4 + 1 + 3 * 8 + 4 * 8;  // of a frame

/// A big-endian 16 or 32 bit length at `offset`; -1 where the bytes end before it.
int length16_at(std::span<const std::byte> bytes, std::size_t offset) noexcept {
  if (bytes.size() < offset + 2) return -1;
  const auto high = std::to_integer<unsigned>(bytes[offset]);
  const auto low = std::to_integer<unsigned>(bytes[offset + 1]);
  return static_cast<std::int16_t>(high << 8 | low);
}

std::int64_t length32_at(std::span<const std::byte> bytes, std::size_t offset) noexcept {
  if (bytes.size() < offset + 4) return -1;
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k)
    value = value << 8 | std::to_integer<std::uint32_t>(bytes[offset + k]);
  return static_cast<std::int32_t>(value);
}

/// A length within [0, limit], or -1.
int bounded(int length, int limit) noexcept { return length <= limit ? length : -1; }

/// Of segments that stretch: all of an arm's, or none.
bool all_or_none(int stretching, int segments) noexcept {
  return stretching == 0 || stretching == segments;
}

/// Whether a text of `length` bytes, terminator included, ends there and not before, and is printable
/// ASCII: it comes to somebody's terminal. LCM's decoder accepts any byte as the terminator; its
/// encoder writes up to the first 0.
bool text_at(std::span<const std::byte> bytes, std::size_t offset, std::int64_t length) noexcept {
  if (length < 1 || length > static_cast<std::int64_t>(kLongestText)) return false;
  const auto size = static_cast<std::size_t>(length);
  if (bytes.size() < offset + size) return false;
  const auto text = bytes.subspan(offset, size);
  return text.back() == std::byte{0} &&
         std::all_of(text.begin(), text.end() - 1, [](std::byte each) {
           return each >= std::byte{' '} && each <= std::byte{'~'};
         });
}

template <class Message>
bool decode_exactly(std::span<const std::byte> bytes, std::size_t expected,
                    Message& message) noexcept {
  return bytes.size() == expected &&
         message.decode(bytes.data(), 0, static_cast<int>(bytes.size())) ==
             static_cast<int>(bytes.size());
}

/// A message whose only length is a 16-bit number after `fixed` bytes, followed by that many
/// elements of `element` bytes.
template <class Message>
bool decode_list(std::span<const std::byte> bytes, std::size_t fixed, std::size_t element,
                 int limit, Message& message) noexcept {
  const int length = bounded(length16_at(bytes, kHash + fixed), limit);
  return length >= 0 &&
         decode_exactly(bytes, kHash + fixed + 2 + element * static_cast<std::size_t>(length),
                        message);
}

}  // namespace

bool decode(std::span<const std::byte> bytes, softarm_messages::mocap_frame_t& message) noexcept {
  return decode_list(bytes, 8 + 8, kBody, 4 * kMaxBodies, message);  // other bodies may be in view
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::pressure_command_t& message) noexcept {
  return decode_list(bytes, 8 + 8 + 4 + 1, 4, kMaxChambers, message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::torque_command_t& message) noexcept {
  return decode_list(bytes, 8 + 8 + 4 + 1, 8, kMaxChambers, message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::pressure_measurement_t& message) noexcept {
  return decode_list(bytes, 8 + 8 + 4 + 4 + 1, 4, kMaxChambers, message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::curvature_reference_t& message) noexcept {
  return decode_list(bytes, 8, 3 * 8, 2 * kMaxSegments, message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::operator_command_t& message) noexcept {
  return decode_exactly(bytes, kHash + 2 * 8 + 1, message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::controller_status_t& message) noexcept {
  constexpr std::size_t kBeforeVersion = 6 * 8;
  const std::int64_t version = length32_at(bytes, kHash + kBeforeVersion);
  if (!text_at(bytes, kHash + kBeforeVersion + 4, version)) return false;
  const std::size_t counts =
      kHash + kBeforeVersion + 4 + static_cast<std::size_t>(version) + 4 + 4 + 6 * 4 + 1 + 19 * 4;
  const int segments = bounded(length16_at(bytes, counts), kMaxSegments);
  const int chambers = bounded(length16_at(bytes, counts + 2), kMaxChambers);
  const int stretching = length16_at(bytes, counts + 4);
  if (segments < 0 || chambers < 0 || !all_or_none(stretching, segments)) return false;
  constexpr std::size_t kSegment = 12 * 4;
  return decode_exactly(bytes,
                        counts + 6 + kSegment * static_cast<std::size_t>(segments) +
                            4 * static_cast<std::size_t>(chambers) +
                            4 * 4 * static_cast<std::size_t>(stretching),
                        message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::tip_target_t& message) noexcept {
  return decode_exactly(bytes, kHash + 7 * 8, message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::law_state_t& message) noexcept {
  constexpr std::size_t kFixed = 3 * 8 + 1 + 8;
  const int dimension = bounded(length16_at(bytes, kHash + kFixed), 2 * kMaxSegments);
  const int chambers = bounded(length16_at(bytes, kHash + kFixed + 2), kMaxChambers);
  if (dimension < 0 || chambers < 0) return false;
  return decode_exactly(bytes,
                        kHash + kFixed + 4 + 5 * 8 * static_cast<std::size_t>(dimension) +
                            4 * static_cast<std::size_t>(chambers),
                        message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::law_command_t& message) noexcept {
  return decode_list(bytes, 8 + 8 + 4 + 1, 8, kMaxChambers, message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::plant_state_t& message) noexcept {
  const int segments = bounded(length16_at(bytes, kHash + 8 + 1), kMaxSegments);
  const int chambers = bounded(length16_at(bytes, kHash + 8 + 1 + 2), kMaxChambers);
  const int stretching = length16_at(bytes, kHash + 8 + 1 + 4);
  if (segments < 0 || chambers < 0 || !all_or_none(stretching, segments)) return false;
  return decode_exactly(bytes,
                        kHash + 8 + 1 + 6 + 4 * 8 * static_cast<std::size_t>(segments) +
                            4 * static_cast<std::size_t>(chambers) + 3 * 8 +
                            2 * 8 * static_cast<std::size_t>(stretching),
                        message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::timing_t& message) noexcept {
  return decode_exactly(bytes, kHash + 3 * 8 + 4 * 32 * 4 + 4 * 4, message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::observer_status_t& message) noexcept {
  constexpr std::size_t kCounts = kHash + 2 * 8 + 2 + 4 + 4 + 3 * 4 + 9 * 4;
  const int segments = bounded(length16_at(bytes, kCounts), kMaxSegments);
  const int stretching = length16_at(bytes, kCounts + 2);
  if (segments < 0 || !all_or_none(stretching, segments)) return false;
  return decode_exactly(
      bytes,
      kCounts + 4 +
          4 * (14 * static_cast<std::size_t>(segments) + 10 * static_cast<std::size_t>(stretching)),
      message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::tick_record_t& message) noexcept {
  constexpr std::size_t kCounts = kHash + 10 * 8 + 4 + 9;  // numbers and flags come first
  const int chambers = bounded(length16_at(bytes, kCounts), kMaxChambers);
  const int dimension = bounded(length16_at(bytes, kCounts + 2), 2 * kMaxSegments);
  const int frames = bounded(length16_at(bytes, kCounts + 4), TickRecorder::kMostFrames);
  const int measured = bounded(length16_at(bytes, kCounts + 6), kMaxChambers);
  const int law = bounded(length16_at(bytes, kCounts + 8), kMaxChambers);
  const int tip = length16_at(bytes, kCounts + 10);
  if (chambers < 0 || dimension < 0 || frames < 0 || measured < 0 || law < 0) return false;
  if (tip != 0 && tip != 6) return false;
  std::size_t at = kCounts + 12 + 4 * static_cast<std::size_t>(measured) +
                   8 * static_cast<std::size_t>(chambers + 3 * dimension + law + tip);
  for (int k = 0; k < frames; ++k) {
    const int bodies = bounded(length16_at(bytes, at + 2 * 8), kMaxBodies);
    if (bodies < 1) return false;
    at += 2 * 8 + 2 + kBody * static_cast<std::size_t>(bodies);
  }
  const std::int64_t build = length32_at(bytes, at);
  if (!text_at(bytes, at + 4, build)) return false;
  return decode_exactly(bytes, at + 4 + static_cast<std::size_t>(build) + 8, message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::valves_status_t& message) noexcept {
  // Two lists of the same length.
  return decode_list(bytes, 3 * 8 + 2 * 1 + 2 + 7 * 4, 2 * 4, kMaxChambers, message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::deadman_t& message) noexcept {
  return decode_exactly(bytes, kHash + 2 * 8 + 1, message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::rigid_transform_t& message) noexcept {
  return decode_exactly(bytes, kHash + 8 + 7 * 8, message);
}

}  // namespace softarm
