// softarm-dev bench mocap: what a motion-capture source with a server costs over a bare socket.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "dev/commands.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/transport/mocap_source.hpp"

namespace softarm {
namespace {

constexpr int kSegments = 3, kOtherBodies = 20;
constexpr std::int64_t kPatience_ns = 5'000'000'000;

/// Two connected sockets of this machine.
class Pair {
 public:
  explicit Pair(int type) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const where = reinterpret_cast<sockaddr*>(&address);
    const int bound = socket(AF_INET, type, 0);
    sender_ = socket(AF_INET, type, 0);
    if (bind(bound, where, size) != 0 || getsockname(bound, where, &size) != 0 ||
        (type == SOCK_STREAM && listen(bound, 1) != 0) || connect(sender_, where, size) != 0)
      throw std::runtime_error("no sockets on the loopback network");
    receiver_ = type == SOCK_STREAM ? accept(bound, nullptr, nullptr) : bound;
    if (type == SOCK_STREAM) close(bound);
    const int on = 1;
    setsockopt(sender_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  }
  ~Pair() {
    close(sender_);
    close(receiver_);
  }
  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;

  /// Time from the end of sending until the bytes are in our memory, ns.
  std::int64_t once(std::span<const std::byte> bytes) {
    if (send(sender_, bytes.data(), bytes.size(), 0) < 0) throw std::runtime_error("not sent");
    const std::int64_t sent_ns = monotonic_now_ns();
    for (std::size_t got = 0; got < bytes.size();) {
      const ssize_t part = recv(receiver_, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
      if (part > 0) got += static_cast<std::size_t>(part);
    }
    return monotonic_now_ns() - sent_ns;
  }

 private:
  int sender_ = -1, receiver_ = -1;
  std::array<std::byte, 65536> buffer_;
};

TransportSettings settings(const MocapSourceKind& kind, int port) {
  TransportSettings transport;
  transport.mocap.source = kind;
  transport.mocap.unit = kind.unit;
  transport.mocap.quaternion = kind.quaternion;
  transport.mocap.network.port = port;
  transport.mocap.network.version = kind.network->version;
  transport.bodies.base_id = 0;
  for (int k = 0; k <= kSegments; ++k)
    if (k > 0) transport.bodies.segment_ids.push_back(k);
  return transport;
}

double quantile_us(std::vector<std::int64_t>& times_ns, double part) {
  const auto at = static_cast<std::ptrdiff_t>(part * static_cast<double>(times_ns.size() - 1));
  std::nth_element(times_ns.begin(), times_ns.begin() + at, times_ns.end());
  return 1e-3 * static_cast<double>(times_ns[static_cast<std::size_t>(at)]);
}

/// Alternates a packet of a bare socket and a frame through the source.
std::string measure(const MocapSourceKind& kind, int port, int frames) {
  const TransportSettings transport = settings(kind, port);
  ArmParameters arm;
  arm.segments.resize(kSegments);
  const auto server = kind.network->serve(transport);
  MocapSource source(transport, {}, arm);
  source.open(transport);
  SentFrame sent;
  sent.bodies = 1 + kSegments + kOtherBodies;
  for (std::size_t k = 0; k < sent.bodies; ++k)
    sent.body[k] = {static_cast<std::int32_t>(k), true, {0.1, 0.2, 0.3}, {1, 0, 0, 0}};
  MocapFrame frame;
  const std::int64_t begin_ns = monotonic_now_ns();
  while (source.receive(monotonic_now_ns(), frame) != MocapReceipt::frame) {
    if (monotonic_now_ns() - begin_ns > kPatience_ns)
      throw std::runtime_error(std::string(kind.name()) + ": no frame");
    ++sent.frame_number;
    server->send(sent);
  }
  while (source.receive(monotonic_now_ns(), frame) == MocapReceipt::frame) {  // no others wait
  }
  const auto format = kind.make();
  const auto bytes = format->encode(sent);
  Pair bare(kind.network->multicast ? SOCK_DGRAM : SOCK_STREAM);
  std::vector<std::int64_t> bare_ns, source_ns;
  for (int k = 0; k < frames; ++k) {
    bare_ns.push_back(bare.once(bytes));
    ++sent.frame_number;
    sent.sender_time_us += 5000;
    server->send(sent);
    const std::int64_t sent_ns = monotonic_now_ns();
    while (source.receive(monotonic_now_ns(), frame) != MocapReceipt::frame) {
      if (monotonic_now_ns() - sent_ns > kPatience_ns)
        throw std::runtime_error(std::string(kind.name()) + ": a frame was lost");
    }
    source_ns.push_back(monotonic_now_ns() - sent_ns);
  }
  const double bare_p99 = quantile_us(bare_ns, 0.99), source_p99 = quantile_us(source_ns, 0.99);
  return fmt::format("{:<8}{:>7}{:>10.2f}{:>10.2f}{:>12.2f}{:>10.2f}{:>10.2f}\n", kind.name(),
                     bytes.size(), quantile_us(bare_ns, 0.5), bare_p99, quantile_us(source_ns, 0.5),
                     source_p99, source_p99 - bare_p99);
}

}  // namespace

void add_bench_mocap_command(CLI::App& group) {
  struct Options {
    int frames = 20000, port = 21510;
  };
  auto options = std::make_shared<Options>();
  CLI::App* command = group.add_subcommand(
      "mocap", "A frame of natnet and qtm beside the same bytes through a bare socket");
  command->add_option("--frames", options->frames, "of each")
      ->check(CLI::Range(100, 10'000'000))
      ->capture_default_str();
  command->add_option("--port", options->port, "of the loopback network, for the servers")
      ->check(CLI::Range(1024, 65000))
      ->capture_default_str();
  command->callback([options] {
    std::string text = fmt::format(
        "from the end of sending to the frame, us, {} "
        "bodies\n{:<8}{:>7}{:>10}{:>10}{:>12}{:>10}{:>10}\n",
        1 + kSegments + kOtherBodies, "source", "bytes", "bare p50", "bare p99", "source p50",
        "p99", "added p99");
    int port = options->port;
    for (const MocapSourceKind& kind : mocap_sources().all())
      if (kind.network) text += measure(kind, port++, options->frames);
    std::fwrite(text.data(), 1, text.size(), stdout);
  });
}

}  // namespace softarm
