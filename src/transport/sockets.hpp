// Sockets that never wait, for motion capture that does not come over LCM.
#pragma once

#include <netinet/in.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace softarm {

inline constexpr int kMostPackets = 64;  ///< that a source takes in one step
/// No answer, or no frame, for so long: a source asks for everything again. The server may come
/// back as another version.
inline constexpr std::int64_t kSilent_ns = 2'000'000'000;

/// Owns a descriptor.
class Socket {
 public:
  Socket() = default;
  explicit Socket(int descriptor) noexcept : descriptor_(descriptor) {}
  ~Socket() { close(); }
  Socket(Socket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }

  bool is_open() const noexcept { return descriptor_ >= 0; }
  int descriptor() const noexcept { return descriptor_; }
  void close() noexcept;

 private:
  int descriptor_ = -1;
};

/// An IPv4 address and port. @throws TransportError where `host` is not four numbers with dots
sockaddr_in socket_address(const std::string& host, int port);

/// Of UDP, bound. @param shared other programs may receive on the same port (multicast)
/// @throws TransportError
Socket udp_socket(const sockaddr_in& bound, bool shared = false);
/// @throws TransportError
void join_multicast(const Socket& socket, const std::string& group, const std::string& local);
/// Of TCP, listening. @throws TransportError
Socket tcp_listener(const sockaddr_in& bound);
/// Begins to connect; not open where that fails at once. Allocates nothing.
Socket tcp_connect(const sockaddr_in& server) noexcept;
/// Whether a connection that was begun is there, has failed, or neither.
enum class Connecting { under_way, connected, failed };
Connecting tcp_connecting(const Socket& socket) noexcept;
/// The next client of a listener; not open where none waits.
Socket tcp_accept(const Socket& listener) noexcept;

/// What came in one call.
struct Received {
  std::size_t bytes = 0;      ///< in the buffer; a longer datagram counts as longer than the buffer
  bool closed = false;        ///< by the other end, or broken
  sockaddr_in from{};         ///< of datagrams
  std::int64_t stamp_us = 0;  ///< arrival on the wall clock, by the kernel; 0: not stamped
};
/// Empty where nothing has arrived. Allocates nothing.
std::optional<Received> receive(const Socket& socket, std::span<std::byte> buffer) noexcept;
/// Whether all was sent.
bool send(const Socket& socket, std::span<const std::byte> bytes,
          const sockaddr_in* to = nullptr) noexcept;

}  // namespace softarm
