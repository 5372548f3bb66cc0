// Packets that no well-behaved sender sends, on LCM's multicast group.
#pragma once

#include <netinet/in.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "softarm/transport/settings.hpp"

namespace softarm {

using Packet = std::vector<std::byte>;

/// Sends UDP datagrams as they are to the group of an LCM URL (udpm://ADDRESS:PORT?ttl=...), with a
/// time to live of 0: nothing leaves the machine.
class RawSender {
 public:
  /// @throws TransportError for another kind of URL or if no socket can be opened
  explicit RawSender(const std::string& url);
  ~RawSender();
  RawSender(const RawSender&) = delete;
  RawSender& operator=(const RawSender&) = delete;

  bool send(std::span<const std::byte> packet) noexcept;

 private:
  int socket_ = -1;
  sockaddr_in group_{};
};

/// A packet that LCM takes for a message of these bytes on this channel.
Packet lcm_packet(const std::string& channel, std::span<const std::byte> payload);

/// A good message of a channel, and where it may be corrupted.
struct SampleMessage {
  std::string channel;
  Packet bytes;
  std::size_t count_at = 0;  ///< of its 16 bit count; 0: it has none
  std::size_t number_at =
      0;  ///< of a number that must be finite; 0: none that is judged when it comes
  std::size_t number_bytes = 0;  ///< 4 or 8
};
/// One of every channel that the daemon listens to, and of its commands.
std::vector<SampleMessage> sample_messages(const LcmSettings& lcm, int segments, int chambers);

/// What is no message, in a packet for this channel: no header, half of one, no end of the
/// channel's name, nothing at all, another type, `message` cut off, `message` with bytes behind it,
/// and with the 16 bit count at `count_at` (0: it has none) made negative, huge and wrong.
/// Fragments are left out: a crafted second one ends every subscriber inside LCM 1.3.1.
std::vector<Packet> hostile_packets(const std::string& channel, std::span<const std::byte> message,
                                    std::size_t count_at);

/// The above for every channel that the daemon listens to, and for its commands.
std::vector<Packet> hostile_packets(const LcmSettings& lcm);

/// The beginning of a message in fragments, and a second fragment whose offset and size together
/// pass 2^32: inside LCM 1.3.1 they end every process that subscribes to this channel.
std::array<Packet, 2> fragments_that_end_subscribers(const std::string& channel);

}  // namespace softarm
