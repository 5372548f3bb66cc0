// OptiTrack's Motive by NatNet: a client in the tick, and a server for the simulated arm.
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <vector>

#include "softarm/base/clock.hpp"
#include "softarm/transport/arrival_clock.hpp"
#include "softarm/transport/mocap_connection.hpp"
#include "softarm/transport/settings.hpp"
#include "transport/byte_cursor.hpp"
#include "transport/natnet_packets.hpp"
#include "transport/sockets.hpp"

namespace softarm {
namespace {

constexpr std::size_t kLargestDatagram = 65'535;
constexpr std::int64_t kAskAgain_ns = 500'000'000;
/// A client of the simulated server that has not asked for so long is gone.
constexpr std::int64_t kGone_ns = 5'000'000'000;

/// "4.1". What is not such a text has been refused with the configuration.
NatnetVersion version_of(const std::string& text) {
  NatnetVersion version;
  const auto dot = std::from_chars(text.data(), text.data() + text.size(), version.major);
  if (dot.ptr != text.data() + text.size())
    std::from_chars(dot.ptr + 1, text.data() + text.size(), version.minor);
  return version;
}

class NatnetConnection final : public MocapConnection {
 public:
  explicit NatnetConnection(const TransportSettings& transport)
      : network_(transport.mocap.network),
        server_(socket_address(network_.host, network_.port)),
        names_(transport.bodies),
        commands_(udp_socket(socket_address(network_.local_address, 0))),
        buffer_(kLargestDatagram),
        connect_(natnet_request(NatnetMessage::connect)),
        keep_alive_(natnet_request(NatnetMessage::keep_alive)),
        ask_models_(natnet_request(NatnetMessage::request_models)) {
    if (network_.multicast.empty()) return;
    data_ = udp_socket(socket_address(network_.multicast, network_.data_port), true);
    join_multicast(data_, network_.multicast, network_.local_address);
  }

  MocapNews next(std::int64_t now_ns, SentFrame& frame,
                 std::int64_t& arrival_ns) noexcept override {
    if (now_ns != now_ns_) begin(now_ns);
    for (; packets_ < kMostPackets; ++packets_) {
      auto received = receive(commands_, buffer_);
      if (!received && data_.is_open()) received = receive(data_, buffer_);
      if (!received) return MocapNews::nothing;
      if (received->from.sin_addr.s_addr != server_.sin_addr.s_addr) continue;
      if (received->bytes > buffer_.size()) return MocapNews::malformed;
      const MocapNews news = take({buffer_.data(), received->bytes}, frame);
      if (news == MocapNews::nothing) continue;
      arrival_ns = std::min(now_ns, arrivals_.arrival_ns(received->stamp_us));
      if (news == MocapNews::frame) newest_ns_ = now_ns;
      return news;
    }
    return MocapNews::nothing;
  }

  MocapStanding standing() const noexcept override {
    if (newest_ns_ == kNever && !(known_ && models_known_)) return {};
    if (const NamedBody* const body = names_.missing())
      return {MocapStanding::State::no_body, body->name.c_str()};
    if (newest_ns_ == kNever) return {};
    return {MocapStanding::State::running, ""};
  }

 private:
  /// The first step of a tick: asks for what is missing.
  void begin(std::int64_t now_ns) noexcept {
    now_ns_ = now_ns;
    packets_ = 0;
    arrivals_.look();
    if (newest_ns_ != kNever && now_ns - newest_ns_ > kSilent_ns) {
      newest_ns_ = kNever;
      known_ = models_known_ = false;
    }
    if (asked_ns_ != kNever && now_ns - asked_ns_ < kAskAgain_ns) return;
    asked_ns_ = now_ns;
    if (!known_) send(commands_, connect_, &server_);
    if (known_ && !models_known_) send(commands_, ask_models_, &server_);
    if (known_ && !data_.is_open()) send(commands_, keep_alive_, &server_);
  }

  MocapNews take(std::span<const std::byte> packet, SentFrame& frame) noexcept {
    if (const auto contents = natnet_contents(packet, NatnetMessage::frame); !contents.empty()) {
      if (!known_ || !models_known_) return MocapNews::nothing;
      NatnetNews news;
      if (!decode_natnet_frame(contents, dialect_, frame, news)) return MocapNews::malformed;
      names_.translate(frame);
      if (news.version_changed) known_ = false;
      if (news.models_changed && names_.used()) models_known_ = false;
      return MocapNews::frame;
    }
    if (const auto contents = natnet_contents(packet, NatnetMessage::server_info);
        !contents.empty()) {
      if (!decode_natnet_server(contents, dialect_)) return MocapNews::malformed;
      known_ = true;
      models_known_ = !names_.used();
      asked_ns_ = kNever;
      return MocapNews::nothing;
    }
    if (const auto contents = natnet_contents(packet, NatnetMessage::models);
        !contents.empty() && known_) {
      names_.forget();
      models_known_ = decode_natnet_models(contents, dialect_.version, names_);
      return models_known_ ? MocapNews::nothing : MocapNews::malformed;
    }
    return MocapNews::nothing;  // of no use to us
  }

  MocapNetworkSettings network_;
  sockaddr_in server_;
  BodyNames names_;
  Socket commands_;  ///< where answers come, and frames by unicast
  Socket data_;      ///< where frames come by multicast
  std::vector<std::byte> buffer_;
  std::vector<std::byte> connect_, keep_alive_, ask_models_;
  ArrivalClock arrivals_;
  NatnetDialect dialect_;
  bool known_ = false, models_known_ = false;
  std::int64_t now_ns_ = kNever, asked_ns_ = kNever, newest_ns_ = kNever;
  int packets_ = 0;
};

class NatnetServer final : public MocapServer {
 public:
  explicit NatnetServer(const TransportSettings& transport)
      : network_(transport.mocap.network),
        names_(transport.bodies),
        dialect_{.version = version_of(network_.version)},
        socket_(udp_socket(socket_address(network_.host, network_.port))),
        buffer_(kLargestDatagram) {
    if (network_.multicast.empty()) return;
    multicast_ = socket_address(network_.multicast, network_.data_port);
    const in_addr interface = socket_address(network_.host, 0).sin_addr;
    setsockopt(socket_.descriptor(), IPPROTO_IP, IP_MULTICAST_IF, &interface, sizeof interface);
  }

  void send(const SentFrame& frame) override {
    const std::int64_t now_ns = monotonic_now_ns();
    for (int k = 0; k < kMostPackets; ++k) {
      const auto received = receive(socket_, buffer_);
      if (!received) break;
      if (!received->closed && received->bytes <= buffer_.size())
        answer({buffer_.data(), received->bytes}, received->from, now_ns);
    }
    encode_natnet_frame(frame, dialect_, out_);
    if (multicast_) {
      softarm::send(socket_, out_, &*multicast_);
      return;
    }
    for (const Client& client : clients_)
      if (now_ns - client.heard_ns < kGone_ns) softarm::send(socket_, out_, &client.address);
  }

 private:
  struct Client {
    sockaddr_in address{};
    std::int64_t heard_ns = -kGone_ns;
  };

  void answer(std::span<const std::byte> request, const sockaddr_in& from, std::int64_t now_ns) {
    LittleEndianCursor cursor(request);
    const auto kind = static_cast<NatnetMessage>(cursor.take<std::uint16_t>());
    if (!cursor.ok()) return;
    out_.clear();
    if (kind == NatnetMessage::connect) encode_natnet_server(dialect_, out_);
    if (kind == NatnetMessage::request_models) encode_natnet_models(dialect_.version, names_, out_);
    if (!out_.empty()) softarm::send(socket_, out_, &from);
    const auto same = [&](const Client& client) {
      return client.address.sin_port == from.sin_port &&
             client.address.sin_addr.s_addr == from.sin_addr.s_addr;
    };
    auto place = std::find_if(clients_.begin(), clients_.end(), same);
    if (place == clients_.end())  // in place of the one that has been silent longest
      place = std::min_element(clients_.begin(), clients_.end(), [](const auto& a, const auto& b) {
        return a.heard_ns < b.heard_ns;
      });
    *place = {from, now_ns};
  }

  MocapNetworkSettings network_;
  BodyNames names_;
  NatnetDialect dialect_;
  Socket socket_;
  std::optional<sockaddr_in> multicast_;
  std::vector<std::byte> buffer_, out_;
  std::array<Client, 8> clients_;
};

/// Frames of 4.1, as the simulated server sends them.
class NatnetFormat final : public MocapFormat {
 public:
  bool decode(std::span<const std::byte> bytes, SentFrame& frame) noexcept override {
    NatnetNews news;
    const auto contents = natnet_contents(bytes, NatnetMessage::frame);
    return !contents.empty() && decode_natnet_frame(contents, {}, frame, news);
  }
  std::span<const std::byte> encode(const SentFrame& frame) override {
    encode_natnet_frame(frame, {}, bytes_);
    return bytes_;
  }

 private:
  std::vector<std::byte> bytes_;
};

}  // namespace

MocapSourceKind natnet_mocap() {
  return {.label = "natnet",
          .make = made<MocapFormat, NatnetFormat>,
          .channel = "NATNET",
          .quaternion = QuaternionOrder::xyzw,
          .network = MocapNetworkKind{
              .connect = made<MocapConnection, NatnetConnection, const TransportSettings&>,
              .serve = made<MocapServer, NatnetServer, const TransportSettings&>,
              .port = 1510,
              .version = "4.1",
              .multicast = true}};
}

}  // namespace softarm
