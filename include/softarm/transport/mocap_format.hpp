// The messages of a motion-capture system behind one interface: what `daemon.mocap.source` names. A
// new one is a MocapFormat and one line:
//
//   class MyFormat final : public MocapFormat { ... };
//   const MocapSourceRegistration kMine({.label = "my_cameras", .make = made<MocapFormat, MyFormat>});
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "softarm/base/kind.hpp"

namespace softarm {

/// A body as sent: the sender's world, unit and order of the quaternion.
struct SentBody {
  std::int32_t id = 0;  ///< where a packet holds several
  bool seen = false;
  std::array<double, 3> position{};
  std::array<double, 4> orientation{};
};

/// What is used of a packet.
struct SentFrame {
  static constexpr std::size_t kMostBodies = 512;

  std::int64_t frame_number = 0;    ///< counts up by one a frame
  std::int64_t sender_time_us = 0;  ///< sender's clock, at exposure
  std::size_t bodies = 0;
  std::array<SentBody, kMostBodies> body;
};

/// Bytes of one kind of packet and what they say. What the numbers mean (unit, axes, marker
/// frames), which bodies are the arm's and whether they are plausible is decided elsewhere.
class MocapFormat {
 public:
  virtual ~MocapFormat() = default;

  /// Called in the tick with whatever the network delivers. False, and `frame` unspecified, unless
  /// `bytes` are exactly one message with at most kMostBodies bodies (one where every body has its
  /// own channel). Every length is held against the bytes that are left before it is used; nothing
  /// is allocated once messages of that size were decoded; time grows with bytes.size() only.
  virtual bool decode(std::span<const std::byte> bytes, SentFrame& frame) noexcept = 0;

  /// The message that `decode` turns back into this frame, for a simulated arm. Valid until the
  /// next call.
  virtual std::span<const std::byte> encode(const SentFrame& frame) = 0;
};

/// In which order the four numbers of a quaternion are sent.
enum class QuaternionOrder { xyzw, wxyz };

/// Of positions as they are sent.
enum class LengthUnit { metre, millimetre };

/// For the functions below: a new T, as what it is derived from.
template <class Base, class T, class... Arguments>
std::unique_ptr<Base> made(Arguments... arguments) {
  return std::make_unique<T>(arguments...);
}

struct TransportSettings;
class MocapConnection;
class MocapServer;

/// What a source needs that has its own server instead of LCM (mocap_connection.hpp).
struct MocapNetworkKind {
  /// @throws TransportError
  std::unique_ptr<MocapConnection> (*connect)(const TransportSettings& transport);
  std::unique_ptr<MocapServer> (*serve)(const TransportSettings& transport);
  int port = 0;              ///< of the server, unless configured
  const char* version = "";  ///< of the protocol, likewise
  bool multicast = false;    ///< whether frames may come by multicast
};

/// Who sends frames, and in which messages.
struct MocapSourceKind {
  const char* label;  ///< as configurations name it
  std::unique_ptr<MocapFormat> (*make)();
  // What holds where a configuration does not say otherwise.
  const char* channel = "SOFTARM_MOCAP";
  QuaternionOrder quaternion = QuaternionOrder::wxyz;
  /// A packet is one body, on channel `lcm.mocap_channel`, _, its name; bodies with one sender time
  /// are a frame.
  bool channel_per_body = false;
  LengthUnit unit = LengthUnit::metre;
  std::optional<MocapNetworkKind> network = {};  ///< none: over LCM

  /// Whether bodies go by names.
  bool named() const noexcept { return channel_per_body || network.has_value(); }
  const char* name() const noexcept { return label; }
  bool operator==(const MocapSourceKind& other) const noexcept {
    return std::string_view(label) == other.label;
  }
};

/// softarm's own messages, mocap_frame_t.
MocapSourceKind softarm_mocap();

/// The sources that a configuration may name.
Registry<MocapSourceKind>& mocap_sources();

/// Adds a source: the one line that it takes in a program of one's own.
struct MocapSourceRegistration {
  explicit MocapSourceRegistration(const MocapSourceKind& kind) { mocap_sources().add(kind); }
};

}  // namespace softarm
