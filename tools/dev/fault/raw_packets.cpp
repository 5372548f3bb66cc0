#include "dev/fault/raw_packets.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <charconv>

#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr std::uint32_t kShortMessage = 0x4c433032;  ///< "LC02"
constexpr std::uint32_t kFragment = 0x4c433033;      ///< "LC03"

void put32(std::uint32_t value, Packet& packet) {
  for (int shift = 24; shift >= 0; shift -= 8)
    packet.push_back(static_cast<std::byte>(value >> shift & 0xff));
}

sockaddr_in group_of(const std::string& url) {
  const std::string scheme = "udpm://";
  const std::size_t colon = url.find(':', scheme.size());
  sockaddr_in group{};
  group.sin_family = AF_INET;
  std::uint16_t port = 0;
  if (url.starts_with(scheme) && colon != std::string::npos &&
      std::from_chars(url.data() + colon + 1, url.data() + url.size(), port).ec == std::errc() &&
      inet_pton(AF_INET, url.substr(scheme.size(), colon - scheme.size()).c_str(),
                &group.sin_addr) == 1) {
    group.sin_port = htons(port);
    return group;
  }
  throw TransportError("raw packets need a URL like udpm://239.255.76.67:7667?ttl=0, got \"" + url +
                       "\"");
}

}  // namespace

RawSender::RawSender(const std::string& url) : group_(group_of(url)) {
  socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const unsigned char ttl = 0;
  if (socket_ < 0 || setsockopt(socket_, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl) != 0) {
    if (socket_ >= 0) close(socket_);
    throw TransportError("no UDP socket for raw packets");
  }
}

RawSender::~RawSender() { close(socket_); }

bool RawSender::send(std::span<const std::byte> packet) noexcept {
  return sendto(socket_, packet.data(), packet.size(), 0,
                reinterpret_cast<const sockaddr*>(&group_),
                sizeof group_) == static_cast<ssize_t>(packet.size());
}

Packet lcm_packet(const std::string& channel, std::span<const std::byte> payload) {
  static std::uint32_t sequence = 0;
  Packet packet;
  put32(kShortMessage, packet);
  put32(sequence++, packet);
  for (const char c : channel) packet.push_back(static_cast<std::byte>(c));
  packet.push_back(std::byte{0});
  packet.insert(packet.end(), payload.begin(), payload.end());
  return packet;
}

std::vector<Packet> hostile_packets(const std::string& channel, std::span<const std::byte> message,
                                    std::size_t count_at) {
  std::vector<Packet> packets;
  // Below LCM's own header.
  packets.push_back({});
  packets.push_back(Packet(3, std::byte{0x4c}));
  packets.push_back(Packet(200, std::byte{0xff}));
  Packet unterminated = lcm_packet(std::string(32, 'A'), {});
  unterminated.pop_back();
  packets.push_back(unterminated);

  // A header, and then no message.
  const auto add = [&](const Packet& payload) { packets.push_back(lcm_packet(channel, payload)); };
  add({});
  add(Packet(3, std::byte{1}));
  add(Packet(1000, std::byte{0xff}));
  Packet whole(message.begin(), message.end());
  for (const std::size_t cut : {std::size_t{1}, whole.size() / 2, whole.size() - 1})
    add(Packet(whole.begin(), whole.end() - static_cast<std::ptrdiff_t>(cut)));
  for (const int more : {1, 8, 1000}) {
    Packet longer = whole;
    longer.insert(longer.end(), static_cast<std::size_t>(more), std::byte{0});
    add(longer);
  }
  Packet other_type = whole;
  other_type[0] ^= std::byte{0x10};
  add(other_type);
  for (const unsigned count : {0xffffU, 0x8000U, 0x7fffU, 0U, 2U}) {
    if (count_at == 0) break;
    Packet miscounted = whole;
    miscounted[count_at] = static_cast<std::byte>(count >> 8);
    miscounted[count_at + 1] = static_cast<std::byte>(count & 0xff);
    add(miscounted);
  }
  return packets;
}

std::vector<SampleMessage> sample_messages(const LcmSettings& lcm, int segments, int chambers) {
  using namespace softarm_messages;
  constexpr std::size_t kHash = 8;
  std::vector<SampleMessage> all;
  const auto add = [&](const std::string& channel, const auto& message, std::size_t count_at,
                       std::size_t number_bytes) {
    if (channel.empty()) return;
    Packet bytes(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    all.push_back({channel, bytes, count_at, number_bytes > 0 ? count_at + 2 : 0, number_bytes});
  };
  mocap_frame_t frame{};
  frame.num_bodies = static_cast<std::int16_t>(segments + 1);
  frame.bodies.resize(static_cast<std::size_t>(segments) + 1);
  add(lcm.mocap_channel, frame, kHash + 16, 0);
  curvature_reference_t reference{};
  reference.dimension = static_cast<std::int16_t>(2 * segments);
  for (auto* list : {&reference.u_rad, &reference.velocity_radps, &reference.acceleration_radps2})
    list->resize(2 * static_cast<std::size_t>(segments));
  add(lcm.reference_channel, reference, kHash + 8, 8);
  pressure_measurement_t measured{};
  measured.num_chambers = static_cast<std::int16_t>(chambers);
  measured.pressure_bar.resize(static_cast<std::size_t>(chambers));
  add(lcm.measurement_channel, measured, kHash + 25, 4);
  pressure_command_t command{};
  command.num_chambers = measured.num_chambers;
  command.pressure_bar = measured.pressure_bar;
  add(lcm.command_channel, command, kHash + 21, 4);
  add(lcm.operator_channel, operator_command_t{.sequence = 1, .nonce = 0, .request = 0}, 0, 0);
  add(lcm.deadman_channel, deadman_t{.sequence = 1, .nonce = 0, .go = 0}, 0, 0);
  return all;
}

std::vector<Packet> hostile_packets(const LcmSettings& lcm) {
  std::vector<Packet> all;
  for (const SampleMessage& sample : sample_messages(lcm, 1, 1)) {
    const auto packets = hostile_packets(sample.channel, sample.bytes, sample.count_at);
    all.insert(all.end(), packets.begin(), packets.end());
  }
  return all;
}

std::array<Packet, 2> fragments_that_end_subscribers(const std::string& channel) {
  const auto fragment = [](std::uint32_t offset, std::uint32_t number) {
    Packet packet;
    put32(kFragment, packet);
    put32(7, packet);                 // the message's number
    put32(2000, packet);              // its size
    put32(offset, packet);            // where this fragment belongs
    put32(number << 16 | 2, packet);  // the second of two
    return packet;
  };
  Packet first = fragment(0, 0), second = fragment(0xfffff800, 1);
  for (const char c : channel) first.push_back(static_cast<std::byte>(c));
  first.push_back(std::byte{0});
  first.insert(first.end(), 100, std::byte{1});
  second.insert(second.end(), 0x900, std::byte{2});
  return {first, second};
}

}  // namespace softarm
