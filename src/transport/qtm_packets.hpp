// Qualisys' real-time protocol (QTM RT), 1.8 to 1.2x: the packets between QTM and its clients,
// little-endian. Layout as published in Qualisys' "QTM Real-time Server Protocol Documentation".
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "transport/mocap_names.hpp"

namespace softarm {

/// Kinds of packets. Each begins with its size in bytes, these eight included, and its kind.
enum class QtmMessage : std::uint32_t {
  error = 0,
  command = 1,
  xml = 2,
  data = 3,
  no_more_data = 4,
  event = 6
};

constexpr std::size_t kQtmHeader = 8;

/// Kind and size of a packet of which at least the header is there. None unless the size can be
/// that of a packet.
struct QtmHeader {
  std::uint32_t size = 0;  ///< of the whole packet
  QtmMessage kind = QtmMessage::error;
};
std::optional<QtmHeader> qtm_header(std::span<const std::byte> bytes) noexcept;

/// Text of an error, a command or its answer, or XML.
std::string_view qtm_text(std::span<const std::byte> contents) noexcept;

/// As MocapFormat::decode, of the contents of a `data` packet with a component 6DOF with residual.
/// A body's id is its place in the list, from 1. A body that is not seen has a position that is not
/// a number; a matrix that is no rotation becomes a quaternion of zeros, which the frame validator
/// refuses.
bool decode_qtm_frame(std::span<const std::byte> contents, SentFrame& frame) noexcept;

/// Notes places of the bodies of these names, from the answer to "GetParameters 6D". Time grows
/// with the length of the text.
void read_qtm_names(std::string_view xml, BodyNames& names) noexcept;

/// Whole packets.
void encode_qtm_text(QtmMessage kind, std::string_view text, std::vector<std::byte>& out);
void encode_qtm_frame(const SentFrame& frame, std::vector<std::byte>& out);
/// The answer of a simulated server to "GetParameters 6D".
void encode_qtm_names(const BodyNames& names, std::vector<std::byte>& out);

}  // namespace softarm
