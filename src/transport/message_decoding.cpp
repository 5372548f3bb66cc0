#include "softarm/transport/message_decoding.hpp"

#include <algorithm>
#include <cstdint>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/transport/tick_record.hpp"
#include "transport/byte_cursor.hpp"

namespace softarm {
namespace {

constexpr std::size_t kLongestText = 256;             // version or build text, terminator included
constexpr std::size_t kBody = 4 + 1 + 3 * 8 + 4 * 8;  // of a frame

/// Walks over a message, of which it reads lengths alone, and decodes it where they fit.
class Walk {
 public:
  explicit Walk(std::span<const std::byte> bytes) : bytes_(bytes), cursor_(bytes) {
    skip(8);  // the hash, which LCM's decoder judges
  }

  Walk& skip(std::size_t bytes) {
    cursor_.skip(bytes);
    return *this;
  }
  /// A 16-bit length within [0, most].
  std::size_t length(int most) {
    const auto length = cursor_.take<std::int16_t>();
    if (length < 0 || length > most) cursor_.fail();
    return cursor_.ok() ? static_cast<std::size_t>(length) : 0;
  }
  /// A length that is 0 or all, such as that of an arm's segments that stretch.
  std::size_t all_or_none(std::size_t all) {
    const std::size_t length = this->length(static_cast<int>(all));
    if (length != 0 && length != all) cursor_.fail();
    return length;
  }
  /// The only length of a message, before so many lists of it whose elements take `element` bytes
  /// together.
  Walk& list(std::size_t element, int most) {
    const std::size_t length = this->length(most);
    return skip(element * length);
  }
  /// A text that ends with its terminator and not before, and is printable ASCII: it comes to
  /// somebody's terminal. LCM's decoder accepts any byte as the terminator; its encoder writes up to
  /// the first 0.
  Walk& text() {
    const auto length = cursor_.take<std::int32_t>();
    if (length < 1 || length > static_cast<std::int32_t>(kLongestText)) cursor_.fail();
    const auto text = cursor_.take_bytes(cursor_.ok() ? static_cast<std::size_t>(length) : 0);
    const bool good = !text.empty() && text.back() == std::byte{0} &&
                      std::all_of(text.begin(), text.end() - 1, [](std::byte each) {
                        return each >= std::byte{' '} && each <= std::byte{'~'};
                      });
    if (!good) cursor_.fail();
    return *this;
  }
  void fail() { cursor_.fail(); }

  template <class Message>
  bool decode(Message& message) const {
    const int size = static_cast<int>(bytes_.size());
    return cursor_.at_end() && message.decode(bytes_.data(), 0, size) == size;
  }

 private:
  std::span<const std::byte> bytes_;
  BigEndianCursor cursor_;
};

}  // namespace

bool decode(std::span<const std::byte> bytes, softarm_messages::mocap_frame_t& message) noexcept {
  // Other bodies may be in view.
  return Walk(bytes).skip(2 * 8).list(kBody, 4 * kMaxBodies).decode(message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::pressure_command_t& message) noexcept {
  return Walk(bytes).skip(2 * 8 + 4 + 1).list(4, kMaxChambers).decode(message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::torque_command_t& message) noexcept {
  return Walk(bytes).skip(2 * 8 + 4 + 1).list(8, kMaxChambers).decode(message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::pressure_measurement_t& message) noexcept {
  return Walk(bytes).skip(2 * 8 + 2 * 4 + 1).list(4, kMaxChambers).decode(message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::curvature_reference_t& message) noexcept {
  return Walk(bytes).skip(8).list(3 * 8, 2 * kMaxSegments).decode(message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::operator_command_t& message) noexcept {
  return Walk(bytes).skip(2 * 8 + 1).decode(message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::controller_status_t& message) noexcept {
  Walk walk(bytes);
  walk.skip(6 * 8).text().skip(2 * 4 + 6 * 4 + 1 + 19 * 4);
  const std::size_t segments = walk.length(kMaxSegments), chambers = walk.length(kMaxChambers);
  const std::size_t stretching = walk.all_or_none(segments);
  return walk.skip(4 * (12 * segments + chambers + 4 * stretching)).decode(message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::tip_target_t& message) noexcept {
  return Walk(bytes).skip(7 * 8).decode(message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::law_state_t& message) noexcept {
  Walk walk(bytes);
  walk.skip(3 * 8 + 1 + 8);
  const std::size_t dimension = walk.length(2 * kMaxSegments), chambers = walk.length(kMaxChambers);
  return walk.skip(5 * 8 * dimension + 4 * chambers).decode(message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::law_command_t& message) noexcept {
  return Walk(bytes).skip(2 * 8 + 4 + 1).list(8, kMaxChambers).decode(message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::plant_state_t& message) noexcept {
  Walk walk(bytes);
  walk.skip(8 + 1);
  const std::size_t segments = walk.length(kMaxSegments), chambers = walk.length(kMaxChambers);
  const std::size_t stretching = walk.all_or_none(segments);
  return walk.skip(8 * (4 * segments + 3 + 2 * stretching) + 4 * chambers).decode(message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::timing_t& message) noexcept {
  return Walk(bytes).skip(3 * 8 + 4 * 32 * 4 + 4 * 4).decode(message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::observer_status_t& message) noexcept {
  Walk walk(bytes);
  walk.skip(2 * 8 + 2 + 2 * 4 + 3 * 4 + 9 * 4);
  const std::size_t segments = walk.length(kMaxSegments);
  const std::size_t stretching = walk.all_or_none(segments);
  return walk.skip(4 * (14 * segments + 10 * stretching)).decode(message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::tick_record_t& message) noexcept {
  Walk walk(bytes);
  walk.skip(10 * 8 + 4 + 9);  // numbers and flags
  const std::size_t chambers = walk.length(kMaxChambers), dimension = walk.length(2 * kMaxSegments),
                    frames = walk.length(TickRecorder::kMostFrames),
                    measured = walk.length(kMaxChambers), law = walk.length(kMaxChambers),
                    tip = walk.all_or_none(6);
  walk.skip(4 * measured + 8 * (chambers + 3 * dimension + law + tip));
  for (std::size_t k = 0; k < frames; ++k) {
    const std::size_t bodies = walk.skip(2 * 8).length(kMaxBodies);
    if (bodies == 0) walk.fail();
    walk.skip(kBody * bodies);
  }
  return walk.text().skip(kRecordDigest).decode(message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::valves_status_t& message) noexcept {
  return Walk(bytes).skip(3 * 8 + 2 + 2 + 7 * 4).list(2 * 4, kMaxChambers).decode(message);
}

bool decode(std::span<const std::byte> bytes, softarm_messages::deadman_t& message) noexcept {
  return Walk(bytes).skip(2 * 8 + 1).decode(message);
}

bool decode(std::span<const std::byte> bytes,
            softarm_messages::rigid_transform_t& message) noexcept {
  return Walk(bytes).skip(8 + 7 * 8).decode(message);
}

}  // namespace softarm
