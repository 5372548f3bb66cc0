#include "transport/sockets.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "softarm/transport/lcm_node.hpp"

namespace softarm {
namespace {

constexpr int kBacklog = 4;

[[noreturn]] void fail(const std::string& what) {
  throw TransportError(what + ": " + std::strerror(errno));
}

std::string text(const sockaddr_in& address) {
  char digits[INET_ADDRSTRLEN] = "";
  inet_ntop(AF_INET, &address.sin_addr, digits, sizeof digits);
  return std::string(digits) + " port " + std::to_string(ntohs(address.sin_port));
}

template <class Value>
bool set(const Socket& socket, int level, int option, const Value& value) noexcept {
  return setsockopt(socket.descriptor(), level, option, &value, sizeof value) == 0;
}

Socket bound_socket(int type, const sockaddr_in& bound, bool shared) {
  Socket made(socket(AF_INET, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!made.is_open()) fail("no socket");
  if (shared && !set(made, SOL_SOCKET, SO_REUSEADDR, 1)) fail("a shared port");
  if (bind(made.descriptor(), reinterpret_cast<const sockaddr*>(&bound), sizeof bound) != 0)
    fail("cannot use " + text(bound) + " of this machine");
  set(made, SOL_SOCKET, SO_TIMESTAMPNS, 1);
  return made;
}

}  // namespace

void Socket::close() noexcept {
  if (is_open()) ::close(std::exchange(descriptor_, -1));
}

sockaddr_in socket_address(const std::string& host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (inet_pton(AF_INET, host.c_str(), &address.sin_addr) != 1)
    throw TransportError("\"" + host + "\": expected an IPv4 address such as 192.168.1.20");
  return address;
}

Socket udp_socket(const sockaddr_in& bound, bool shared) {
  return bound_socket(SOCK_DGRAM, bound, shared);
}

void join_multicast(const Socket& socket, const std::string& group, const std::string& local) {
  const ip_mreq request{.imr_multiaddr = socket_address(group, 0).sin_addr,
                        .imr_interface = socket_address(local, 0).sin_addr};
  if (!set(socket, IPPROTO_IP, IP_ADD_MEMBERSHIP, request))
    fail("cannot join the multicast group " + group + " on " + local);
  set(socket, IPPROTO_IP, IP_MULTICAST_ALL, 0);
}

Socket tcp_listener(const sockaddr_in& bound) {
  Socket made = bound_socket(SOCK_STREAM, bound, true);
  if (listen(made.descriptor(), kBacklog) != 0) fail("cannot listen on " + text(bound));
  return made;
}

Socket tcp_connect(const sockaddr_in& server) noexcept {
  Socket made(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!made.is_open()) return made;
  set(made, IPPROTO_TCP, TCP_NODELAY, 1);
  set(made, SOL_SOCKET, SO_TIMESTAMPNS, 1);
  if (connect(made.descriptor(), reinterpret_cast<const sockaddr*>(&server), sizeof server) != 0 &&
      errno != EINPROGRESS)
    made.close();
  return made;
}

Connecting tcp_connecting(const Socket& socket) noexcept {
  pollfd descriptor{.fd = socket.descriptor(), .events = POLLOUT, .revents = 0};
  if (poll(&descriptor, 1, 0) <= 0) return Connecting::under_way;
  int error = 0;
  socklen_t size = sizeof error;
  const bool known = getsockopt(socket.descriptor(), SOL_SOCKET, SO_ERROR, &error, &size) == 0;
  return known && error == 0 ? Connecting::connected : Connecting::failed;
}

Socket tcp_accept(const Socket& listener) noexcept {
  Socket made(accept4(listener.descriptor(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (made.is_open()) set(made, IPPROTO_TCP, TCP_NODELAY, 1);
  return made;
}

std::optional<Received> receive(const Socket& socket, std::span<std::byte> buffer) noexcept {
  Received received;
  iovec part{.iov_base = buffer.data(), .iov_len = buffer.size()};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(timespec))];
  msghdr message{};
  message.msg_name = &received.from;
  message.msg_namelen = sizeof received.from;
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;
  const ssize_t bytes = recvmsg(socket.descriptor(), &message, 0);
  if (bytes < 0) {
    if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return std::nullopt;
    received.closed = true;
    return received;
  }
  received.bytes =
      (message.msg_flags & MSG_TRUNC) != 0 ? buffer.size() + 1 : static_cast<std::size_t>(bytes);
  received.closed = bytes == 0;
  for (cmsghdr* each = CMSG_FIRSTHDR(&message); each != nullptr;
       each = CMSG_NXTHDR(&message, each)) {
    if (each->cmsg_level != SOL_SOCKET || each->cmsg_type != SO_TIMESTAMPNS) continue;
    timespec stamp{};
    std::memcpy(&stamp, CMSG_DATA(each), sizeof stamp);
    received.stamp_us = std::int64_t{stamp.tv_sec} * 1'000'000 + stamp.tv_nsec / 1000;
  }
  return received;
}

bool send(const Socket& socket, std::span<const std::byte> bytes, const sockaddr_in* to) noexcept {
  const ssize_t sent =
      sendto(socket.descriptor(), bytes.data(), bytes.size(), MSG_NOSIGNAL,
             reinterpret_cast<const sockaddr*>(to), to == nullptr ? 0 : sizeof *to);
  return sent == static_cast<ssize_t>(bytes.size());
}

}  // namespace softarm
