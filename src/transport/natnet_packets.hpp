// OptiTrack's NatNet, 3.0 to 4.x: the packets between Motive and its clients, little-endian. Layout
// as published with the NatNet SDK (its "direct depacketization" sample).
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "transport/mocap_names.hpp"

namespace softarm {

/// Kinds of packets, as the first two bytes name them. The next two are the number of bytes that
/// follow.
enum class NatnetMessage : std::uint16_t {
  connect = 0,
  server_info = 1,
  request_models = 4,
  models = 5,
  frame = 7,
  keep_alive = 10
};

/// Version of the protocol: it decides about the layout.
struct NatnetVersion {
  int major = 4, minor = 1;
  auto operator<=>(const NatnetVersion&) const = default;
};

/// What the layout and the times of a server's packets depend on.
struct NatnetDialect {
  NatnetVersion version;
  std::uint64_t ticks_per_s = 10'000'000;  ///< of its high-resolution clock; 0: not known
};

/// Contents of a packet if it is of this kind and as long as it states; empty otherwise.
std::span<const std::byte> natnet_contents(std::span<const std::byte> packet,
                                           NatnetMessage kind) noexcept;

/// Requests of a client: header and an empty text.
std::vector<std::byte> natnet_request(NatnetMessage kind);

/// False unless `contents` are those of server_info, from version 3.0 on.
bool decode_natnet_server(std::span<const std::byte> contents, NatnetDialect& dialect) noexcept;

/// Notes ids of the bodies of these names. False, with some of them perhaps noted, unless
/// `contents` are those of `models`. Rigid bodies count; bones of skeletons do not.
bool decode_natnet_models(std::span<const std::byte> contents, const NatnetVersion& version,
                          BodyNames& names) noexcept;

/// What a frame says besides poses.
struct NatnetNews {
  bool models_changed = false, version_changed = false;
};

/// As MocapFormat::decode, of the contents of a `frame`. The time is that of exposure by the
/// server's high-resolution clock, or its `timestamp` where it gives none.
bool decode_natnet_frame(std::span<const std::byte> contents, const NatnetDialect& dialect,
                         SentFrame& frame, NatnetNews& news) noexcept;

// For a simulated server; whole packets.
void encode_natnet_server(const NatnetDialect& dialect, std::vector<std::byte>& out);
void encode_natnet_models(const NatnetVersion& version, const BodyNames& names,
                          std::vector<std::byte>& out);
void encode_natnet_frame(const SentFrame& frame, const NatnetDialect& dialect,
                         std::vector<std::byte>& out);

}  // namespace softarm
