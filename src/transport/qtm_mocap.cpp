// Qualisys Track Manager by its real-time protocol: a client in the tick, and a server for the
// simulated arm.
#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/transport/arrival_clock.hpp"
#include "softarm/transport/mocap_connection.hpp"
#include "softarm/transport/settings.hpp"
#include "transport/qtm_packets.hpp"
#include "transport/sockets.hpp"

namespace softarm {
namespace {

/// The names of very many bodies with all their markers fit.
constexpr std::size_t kLargestPacket = 1 << 20;
constexpr std::size_t kLargestRequest = 4096;
constexpr std::int64_t kTryAgain_ns = 1'000'000'000;

class QtmConnection final : public MocapConnection {
 public:
  explicit QtmConnection(const TransportSettings& transport)
      : server_(socket_address(transport.mocap.network.host, transport.mocap.network.port)),
        names_(transport.bodies),
        buffer_(kLargestPacket) {
    encode_qtm_text(QtmMessage::command, "Version " + transport.mocap.network.version, version_);
    encode_qtm_text(QtmMessage::command, "GetParameters 6D", ask_names_);
    encode_qtm_text(QtmMessage::command, "StreamFrames AllFrames 6DRes", stream_);
  }

  MocapNews next(std::int64_t now_ns, SentFrame& frame,
                 std::int64_t& arrival_ns) noexcept override {
    if (now_ns != now_ns_) begin(now_ns);
    for (; packets_ < kMostPackets && step_ >= Step::greeting; ++packets_) {
      const auto packet = next_packet();
      if (!packet) return MocapNews::nothing;
      if (packet->empty()) {
        hang_up();
        return MocapNews::malformed;
      }
      const MocapNews news = take(*packet, frame);
      begin_ += packet->size();
      if (news == MocapNews::nothing) continue;
      arrival_ns = std::min(now_ns, arrival_ns_);
      return news;
    }
    return MocapNews::nothing;
  }

  MocapStanding standing() const noexcept override {
    if (step_ != Step::frames) return {};
    if (const NamedBody* const body = names_.missing())
      return {MocapStanding::State::no_body, body->name.c_str()};
    return {seen_frame_ ? MocapStanding::State::running : MocapStanding::State::silent, ""};
  }

 private:
  /// What is awaited.
  enum class Step { pause, connection, greeting, version, names, frames };

  void begin(std::int64_t now_ns) noexcept {
    now_ns_ = now_ns;
    packets_ = 0;
    arrivals_.look();
    const std::int64_t waited_ns = age_ns(now_ns, since_ns_);
    switch (step_) {
      case Step::pause:
        if (waited_ns < kTryAgain_ns) return;
        begin_ = end_ = 0;
        socket_ = tcp_connect(server_);
        proceed(socket_.is_open() ? Step::connection : Step::pause);
        return;
      case Step::connection:
        if (const Connecting how = tcp_connecting(socket_); how == Connecting::connected)
          proceed(Step::greeting);
        else if (how == Connecting::failed || waited_ns > kSilent_ns)
          hang_up();
        return;
      case Step::greeting:
      case Step::version:
        if (waited_ns > kSilent_ns) hang_up();
        return;
      case Step::names:  // none while nothing is measured: asked again, on the same connection
      case Step::frames:
        if (waited_ns > kSilent_ns) ask(ask_names_, Step::names);
        return;
    }
  }

  void proceed(Step step) noexcept {
    step_ = step;
    since_ns_ = now_ns_;
  }
  void hang_up() noexcept {
    socket_.close();
    seen_frame_ = false;
    proceed(Step::pause);
  }
  void ask(std::span<const std::byte> request, Step step) noexcept {
    seen_frame_ = false;
    send(socket_, request) ? proceed(step) : hang_up();
  }

  /// A whole packet; none: it is not there yet; empty: it cannot be one.
  std::optional<std::span<const std::byte>> next_packet() noexcept {
    while (true) {
      const std::span<const std::byte> have(buffer_.data() + begin_, end_ - begin_);
      if (have.size() >= kQtmHeader) {
        const auto header = qtm_header(have);
        if (!header || header->size > buffer_.size()) return std::span<const std::byte>();
        if (header->size <= have.size()) return have.first(header->size);
      }
      if (begin_ > 0) {
        std::memmove(buffer_.data(), have.data(), have.size());
        end_ = have.size();
        begin_ = 0;
      }
      const auto received = receive(socket_, std::span(buffer_).subspan(end_));
      if (!received) return std::nullopt;
      if (received->closed) {
        hang_up();
        return std::nullopt;
      }
      end_ += received->bytes;
      arrival_ns_ = arrivals_.arrival_ns(received->stamp_us);
    }
  }

  MocapNews take(std::span<const std::byte> packet, SentFrame& frame) noexcept {
    const auto contents = packet.subspan(kQtmHeader);
    switch (qtm_header(packet)->kind) {
      case QtmMessage::command:
        if (step_ == Step::greeting)
          ask(version_, Step::version);
        else if (step_ == Step::version)
          ask(ask_names_, Step::names);
        return MocapNews::nothing;
      case QtmMessage::xml:
        names_.forget();
        read_qtm_names(qtm_text(contents), names_);
        ask(stream_, Step::frames);
        return MocapNews::nothing;
      case QtmMessage::data:
        if (!decode_qtm_frame(contents, frame)) return MocapNews::malformed;
        names_.translate(frame);
        seen_frame_ = true;
        since_ns_ = now_ns_;
        return MocapNews::frame;
      case QtmMessage::error:  // such as: no measurement; asked again when nothing comes
      case QtmMessage::no_more_data:
      case QtmMessage::event:
        return MocapNews::nothing;
    }
    return MocapNews::nothing;
  }

  sockaddr_in server_;
  BodyNames names_;
  Socket socket_;
  std::vector<std::byte> buffer_;
  std::size_t begin_ = 0, end_ = 0;  ///< of what is in the buffer
  std::vector<std::byte> version_, ask_names_, stream_;
  ArrivalClock arrivals_;
  Step step_ = Step::pause;
  std::int64_t since_ns_ = kNever;  ///< the beginning of the step, or the newest frame
  std::int64_t now_ns_ = kNever, arrival_ns_ = kNever;
  bool seen_frame_ = false;
  int packets_ = 0;
};

class QtmServer final : public MocapServer {
 public:
  explicit QtmServer(const TransportSettings& transport)
      : names_(transport.bodies),
        listener_(tcp_listener(
            socket_address(transport.mocap.network.host, transport.mocap.network.port))) {}

  void send(const SentFrame& frame) override {
    for (Client& client : clients_) {
      if (!client.socket.is_open()) {
        client = {.socket = tcp_accept(listener_)};
        if (client.socket.is_open())
          reply(client, QtmMessage::command, "QTM RT Interface connected");
        continue;
      }
      serve(client);
      if (!client.streams || !client.socket.is_open()) continue;
      encode_qtm_frame(frame, out_);
      deliver(client);
    }
  }

 private:
  struct Client {
    Socket socket;
    std::vector<std::byte> request{};
    bool streams = false;
  };

  /// A client that does not take what it asked for is not waited for.
  void deliver(Client& client) {
    if (!softarm::send(client.socket, out_)) client.socket.close();
  }
  void reply(Client& client, QtmMessage kind, std::string_view text) {
    encode_qtm_text(kind, text, out_);
    deliver(client);
  }

  void serve(Client& client) {
    std::array<std::byte, kLargestRequest> part{};
    while (client.socket.is_open()) {
      const auto received = receive(client.socket, part);
      if (!received) break;
      client.request.insert(client.request.end(), part.begin(), part.begin() + received->bytes);
      if (received->closed || client.request.size() > kLargestRequest) client.socket.close();
    }
    while (client.socket.is_open() && client.request.size() >= kQtmHeader) {
      const auto header = qtm_header(client.request);
      if (!header || header->size > kLargestRequest) return client.socket.close();
      if (header->size > client.request.size()) return;
      const auto packet = std::span<const std::byte>(client.request).first(header->size);
      answer(client, qtm_text(packet.subspan(kQtmHeader)));
      client.request.erase(client.request.begin(), client.request.begin() + header->size);
    }
  }

  void answer(Client& client, std::string_view command) {
    std::string lower(command);
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (lower.starts_with("version "))
      return reply(client, QtmMessage::command, "Version set to " + lower.substr(8));
    if (lower.starts_with("getparameters")) {
      encode_qtm_names(names_, out_);
      return deliver(client);
    }
    if (lower.starts_with("streamframes")) {
      client.streams = lower.find("stop") == std::string::npos;
      return;
    }
    reply(client, QtmMessage::error, "Parse error");
  }

  BodyNames names_;
  Socket listener_;
  std::array<Client, 4> clients_{};
  std::vector<std::byte> out_;
};

class QtmFormat final : public MocapFormat {
 public:
  bool decode(std::span<const std::byte> bytes, SentFrame& frame) noexcept override {
    const auto header = qtm_header(bytes);
    return header && header->kind == QtmMessage::data && header->size == bytes.size() &&
           decode_qtm_frame(bytes.subspan(kQtmHeader), frame);
  }
  std::span<const std::byte> encode(const SentFrame& frame) override {
    encode_qtm_frame(frame, bytes_);
    return bytes_;
  }

 private:
  std::vector<std::byte> bytes_;
};

}  // namespace

MocapSourceKind qtm_mocap() {
  return {.label = "qtm",
          .make = made<MocapFormat, QtmFormat>,
          .channel = "QTM",
          .unit = LengthUnit::millimetre,
          .network = MocapNetworkKind{
              .connect = made<MocapConnection, QtmConnection, const TransportSettings&>,
              .serve = made<MocapServer, QtmServer, const TransportSettings&>,
              .port = 22223,
              .version = "1.25"}};
}

}  // namespace softarm
