// Packets that no well-behaved sender sends, on LCM's multicast group.
#pragma once

#include <netinet/in.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "softarm/daemon/settings.hpp"

namespace softarm {

using Packet = std::vector<std::byte>;

/// Sends UDP datagrams as they are to the group of an LCM URL (udpm://ADDRESS:PORT?ttl=...), with a
/// time to live of 0: nothing leaves the machine.
class RawSender {
 public:
  /// @throws TransportError for another kind of URL or where there is no socket to be had
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

/// What is no message, in a packet for this channel: no header, half of one, no end of the
/// channel's name, nothing at all, another type, `message` cut off, `message` with bytes behind it,
/// and with the 16 bit count at `count_at` (0: it has none) made negative, huge and wrong.
/// Fragments are left out: a crafted second one ends every subscriber inside LCM 1.3.1.
std::vector<Packet> hostile_packets(const std::string& channel, std::span<const std::byte> message,
                                    std::size_t count_at);

/// The above for every channel that the daemon listens to, and for its commands.
std::vector<Packet> hostile_packets(const LcmSettings& lcm);

}  // namespace softarm
