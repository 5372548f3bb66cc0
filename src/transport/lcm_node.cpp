#include "softarm/transport/lcm_node.hpp"

#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <linux/sock_diag.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string_view>

#include "softarm/base/clock.hpp"

namespace softarm {
namespace {

constexpr const char* kNoRoute =
    ". Without a multicast route give this machine one: ip link set lo up; ip route add "
    "224.0.0.0/4 "
    "dev lo";

/// LCM interprets channel names as regular expressions; ours are literal.
std::string quoted(const std::string& channel) {
  std::string pattern;
  for (const char c : channel) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_') pattern += '\\';
    pattern += c;
  }
  return pattern;
}

/// LCM waits with select(), which aborts above FD_SETSIZE; where descriptors are lacking it reports
/// something else. @throws TransportError
void expect_descriptors() {
  std::array<int, 16> opened{};  // more than LCM needs
  std::size_t count = 0;
  while (count < opened.size() && (opened[count] = eventfd(0, EFD_CLOEXEC)) >= 0) ++count;
  const int error = errno;
  const int highest = count > 0 ? opened[count - 1] : -1;
  for (std::size_t each = 0; each < count; ++each) close(opened[each]);
  if (count < opened.size())
    throw TransportError(std::string("LCM needs 16 file descriptors: ") + std::strerror(error) +
                         ". Raise the limit (ulimit -n), or close some");
  if (highest >= FD_SETSIZE)
    throw TransportError("LCM needs file descriptors below " + std::to_string(FD_SETSIZE) +
                         ", and this process has opened or inherited nearly all of them: close "
                         "them before it starts");
}

/// Which descriptors are UDP sockets that may receive.
std::vector<bool> bound_udp_sockets() {
  std::vector<bool> found(FD_SETSIZE);  // LCM's are below it
  for (int each = 0; each < FD_SETSIZE; ++each) {
    int type = 0;
    sockaddr_in address{};
    socklen_t type_size = sizeof type, size = sizeof address;
    found[static_cast<std::size_t>(each)] =
        getsockopt(each, SOL_SOCKET, SO_TYPE, &type, &type_size) == 0 && type == SOCK_DGRAM &&
        getsockname(each, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
        address.sin_family == AF_INET && address.sin_port != 0;
  }
  return found;
}

/// The kernel's buffer of packets not yet read is as large as the administrator permits: until it
/// is full, no request to a daemon that does not run for a while is lost.
std::string with_large_buffer(const std::string& url) {
  if (!url.starts_with("udpm://") || url.find("recv_buf_size") != std::string::npos) return url;
  constexpr long kEnough = 8'000'000;
  long permitted = 0;
  std::ifstream("/proc/sys/net/core/rmem_max") >> permitted;
  if (permitted <= 0) return url;
  return url + (url.find('?') == std::string::npos ? '?' : '&') +
         "recv_buf_size=" + std::to_string(std::min(permitted, kEnough));
}

lcm_t* create(const std::string& url) {
  expect_descriptors();
  return lcm_create(with_large_buffer(url).c_str());
}

}  // namespace

LcmNode::LcmNode(const std::string& url) : lcm_(create(url)), buffer_(kLargestMessage) {
  if (lcm_ == nullptr) throw TransportError("LCM cannot start on \"" + url + "\"" + kNoRoute);
}

LcmNode::~LcmNode() { lcm_destroy(lcm_); }

/// noexcept: no exception may unwind through LCM's C code, which would leave a lock held.
void LcmNode::dispatch(const lcm_recv_buf_t* packet, const char* /*channel*/, void* user) noexcept {
  // A packet with an unterminated channel name has been observed to claim 2^32 - 1 bytes.
  if (packet->data == nullptr || packet->data_size > LcmNode::kLargestMessage) return;
  const auto& subscription = *static_cast<const Subscription*>(user);
  subscription.handler({.bytes = {static_cast<const std::byte*>(packet->data), packet->data_size},
                        .arrival_ns = subscription.arrivals->arrival_ns(packet->recv_utime),
                        .stamp_us = packet->recv_utime});
}

void LcmNode::subscribe(const std::string& channel, int capacity, Handler handler) {
  const bool first = subscriptions_.empty();  // it makes LCM open the socket
  const std::vector<bool> before = first ? bound_udp_sockets() : std::vector<bool>();
  Subscription& stored = subscriptions_.emplace_back(Subscription{std::move(handler), &arrivals_});
  lcm_subscription_t* subscription =
      lcm_subscribe(lcm_, quoted(channel).c_str(), dispatch, &stored);
  if (subscription == nullptr)
    throw TransportError("LCM cannot subscribe to \"" + channel + "\"" + kNoRoute);
  lcm_subscription_set_queue_capacity(subscription, capacity);
  if (!first) return;
  const std::vector<bool> after = bound_udp_sockets();
  for (std::size_t each = 0; each < after.size(); ++each)
    if (after[each] && !before[each]) socket_ = static_cast<int>(each);
}

std::int64_t LcmNode::dropped() const noexcept {
  std::array<std::uint32_t, SK_MEMINFO_VARS> figures{};
  socklen_t size = sizeof figures;
  if (socket_ < 0 || getsockopt(socket_, SOL_SOCKET, SO_MEMINFO, figures.data(), &size) != 0)
    return 0;
  return figures[SK_MEMINFO_DROPS];
}

int LcmNode::drain(int limit) noexcept {
  arrivals_.look();
  int handled = 0;
  while (handled < limit && lcm_handle_timeout(lcm_, 0) > 0) ++handled;
  return handled;
}

bool LcmNode::wait_until(std::int64_t deadline_ns) noexcept {
  // lcm_handle_timeout counts in milliseconds, which is too coarse for a plant in real time.
  const timespec timeout = time_left(deadline_ns);
  pollfd descriptor{.fd = lcm_get_fileno(lcm_), .events = POLLIN, .revents = 0};
  if (ppoll(&descriptor, 1, &timeout, nullptr) <= 0) return false;
  arrivals_.look();
  return lcm_handle_timeout(lcm_, 0) > 0;
}

bool LcmNode::publish_encoded(const std::string& channel,
                              std::span<const std::byte> bytes) noexcept {
  return !bytes.empty() && lcm_publish(lcm_, channel.c_str(), bytes.data(),
                                       static_cast<unsigned int>(bytes.size())) == 0;
}

bool LcmNode::send(const char* channel, int size) noexcept {
  return lcm_publish(lcm_, channel, buffer_.data(), static_cast<unsigned int>(size)) == 0;
}

std::string network_warning(const std::string& url) {
  const char* const other = std::getenv("LCM_DEFAULT_URL");
  if (other == nullptr || *other == 0) return {};
  if (lock_name("", other) == lock_name("", url)) return {};
  return std::string("LCM_DEFAULT_URL is ") + other + ", daemon.lcm.url is " + url +
         ": softarm uses the latter, other LCM programs of this shell do not hear it";
}

std::string lock_name(const std::string& channel, const std::string& url) {
  constexpr std::string_view kUdp = "udpm://";
  std::string network = url.substr(0, url.find('?'));
  if (network.starts_with(kUdp)) {
    // As LCM 1.3.1 reads it.
    std::string text = network.substr(kUdp.size());
    if (text.empty()) text = "239.255.76.67:7667";
    const std::size_t colon = text.find(':');
    in_addr address{};
    if (inet_aton(text.substr(0, colon).c_str(), &address) == 1) {
      std::array<char, INET_ADDRSTRLEN> digits{};
      inet_ntop(AF_INET, &address, digits.data(), digits.size());
      const long port = colon < text.size() ? std::strtol(text.c_str() + colon + 1, nullptr, 0) : 0;
      network = std::string(kUdp) + digits.data() + ":" + std::to_string(port);
    }
  }
  return channel + " on " + network;
}

bool is_local(const std::string& url) {
  const std::size_t ttl = url.find("ttl=");
  return url.starts_with("udpm://") &&
         (ttl == std::string::npos || std::strtol(url.c_str() + ttl + 4, nullptr, 0) == 0);
}

}  // namespace softarm
