#include "dev/fault/hostile_packets.hpp"

#include <algorithm>
#include <iterator>

#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr std::size_t kMost = 1400;  ///< bytes of noise: one Ethernet packet
constexpr std::byte kNotANumber[] = {std::byte{0x7f}, std::byte{0xf8}};
constexpr std::byte kInfinity[] = {std::byte{0xff}, std::byte{0xf0}};
constexpr std::byte kNotANumber32[] = {std::byte{0x7f}, std::byte{0xc0}};
constexpr std::byte kInfinity32[] = {std::byte{0xff}, std::byte{0x80}};

}  // namespace

HostilePackets::HostilePackets(const LcmSettings& lcm, int segments, int chambers, unsigned seed)
    : samples_(sample_messages(lcm, segments, chambers)), random_(seed) {}

std::size_t HostilePackets::below(std::size_t end) {
  return std::uniform_int_distribution<std::size_t>(0, end - 1)(random_);
}

Packet HostilePackets::noise(std::size_t most) {
  Packet bytes(below(most + 1));
  for (std::byte& each : bytes) each = static_cast<std::byte>(random_());
  return bytes;
}

/// The payload of a message with one fault.
Packet HostilePackets::corrupted(SampleMessage sample) {
  Packet& bytes = sample.bytes;
  switch (below(5)) {
    case 0: {  // bytes behind it
      const Packet more = noise(kMost);
      bytes.insert(bytes.end(), more.begin(), more.end());
      bytes.push_back(std::byte{0});
      return bytes;
    }
    case 1:  // another type
      bytes[below(8)] ^= static_cast<std::byte>(1 + below(255));
      return bytes;
    case 2: {  // a wrong count, negative and huge ones too
      if (sample.count_at == 0) break;
      const std::size_t at = sample.count_at + below(2);
      bytes[at] ^= static_cast<std::byte>(1 + below(255));
      return bytes;
    }
    case 3: {  // not a number, or infinite
      if (sample.number_at == 0) break;
      const bool infinite = below(2) == 0;
      const std::byte* number = sample.number_bytes == 8 ? (infinite ? kInfinity : kNotANumber)
                                                         : (infinite ? kInfinity32 : kNotANumber32);
      const std::size_t numbers = (bytes.size() - sample.number_at) / sample.number_bytes;
      const std::size_t at = sample.number_at + sample.number_bytes * below(numbers);
      std::copy_n(number, 2, bytes.begin() + static_cast<std::ptrdiff_t>(at));
      return bytes;
    }
    default:
      break;
  }
  bytes.resize(below(bytes.size()));  // cut off
  return bytes;
}

/// What LCM itself must refuse, or finds no subscriber for.
Packet HostilePackets::broken_header() {
  const SampleMessage& sample = samples_[below(samples_.size())];
  Packet packet = lcm_packet(sample.channel, sample.bytes);
  switch (below(4)) {
    case 0:  // not LCM's: the first byte of its magic number is another
      packet[0] ^= static_cast<std::byte>(1 + below(255));
      return packet;
    case 1:  // ends within header or channel
      packet.resize(below(8 + sample.channel.size()));
      return packet;
    case 2:  // a name without end, or longer than names may be
      return lcm_packet(std::string(64 + below(200), static_cast<char>(1 + below(255))),
                        sample.bytes);
    default: {  // any letter for a name; few names, for LCM keeps each it has ever seen
      const std::string channel(below(64), static_cast<char>(1 + below(4) * 63));
      return lcm_packet(channel, sample.bytes);
    }
  }
}

Packet HostilePackets::next() {
  const std::size_t kind = below(8);
  if (kind == 0) return broken_header();
  const SampleMessage& sample = samples_[below(samples_.size())];
  if (kind == 1) return lcm_packet(sample.channel, noise(kMost));
  return lcm_packet(sample.channel, corrupted(sample));
}

}  // namespace softarm
