#include "softarm/transport/lcm_node.hpp"

#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <string_view>

#include "softarm/base/clock.hpp"

namespace softarm {
namespace {

/// LCM interprets channel names as regular expressions; ours are literal.
std::string quoted(const std::string& channel) {
  std::string pattern;
  for (const char c : channel) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_') pattern += '\\';
    pattern += c;
  }
  return pattern;
}

ArrivalClock clock_from_now() noexcept {
  const ClockPair now = read_clocks();
  return {now.monotonic_ns, now.wall_ns};
}

}  // namespace

LcmNode::LcmNode(const std::string& url)
    : lcm_(lcm_create(url.c_str())), arrivals_(clock_from_now()), buffer_(kLargestMessage) {
  if (lcm_ == nullptr)
    throw TransportError("LCM cannot start on \"" + url +
                         "\". Without a multicast route give this machine one: "
                         "ip link set lo up; ip route add 224.0.0.0/4 dev lo");
}

LcmNode::~LcmNode() { lcm_destroy(lcm_); }

void LcmNode::look_at_clocks() noexcept {
  const ClockPair now = read_clocks();
  arrivals_.look(now.monotonic_ns, now.wall_ns);
}

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
  Subscription& stored = subscriptions_.emplace_back(std::move(handler), &arrivals_);
  lcm_subscription_t* subscription =
      lcm_subscribe(lcm_, quoted(channel).c_str(), dispatch, &stored);
  if (subscription == nullptr)
    throw TransportError("LCM cannot subscribe to \"" + channel +
                         "\". Without a multicast route give this machine one: "
                         "ip link set lo up; ip route add 224.0.0.0/4 dev lo");
  lcm_subscription_set_queue_capacity(subscription, capacity);
}

int LcmNode::drain(int limit) noexcept {
  look_at_clocks();
  int handled = 0;
  while (handled < limit && lcm_handle_timeout(lcm_, 0) > 0) ++handled;
  return handled;
}

bool LcmNode::wait_until(std::int64_t deadline_ns) noexcept {
  // lcm_handle_timeout counts in milliseconds, which is too coarse for a plant in real time.
  const timespec timeout = time_left(deadline_ns);
  pollfd descriptor{.fd = lcm_get_fileno(lcm_), .events = POLLIN, .revents = 0};
  if (ppoll(&descriptor, 1, &timeout, nullptr) <= 0) return false;
  look_at_clocks();
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
