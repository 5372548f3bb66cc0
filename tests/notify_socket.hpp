// A service manager's end of the protocol of sd_notify(3).
#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace softarm::test {

enum class AddressKind { path, abstract };

/// Listens, and names itself in NOTIFY_SOCKET for what this process starts from now on.
class NotifySocket {
 public:
  explicit NotifySocket(AddressKind kind) {
    static int sockets = 0;
    const std::string name =
        "softarm_notify_" + std::to_string(getpid()) + "_" + std::to_string(sockets++);
    if (kind == AddressKind::path) path_ = std::filesystem::temp_directory_path() / name;
    const std::string shown = kind == AddressKind::path ? path_ : "@" + name;
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    shown.copy(address.sun_path, sizeof address.sun_path - 1);
    if (kind == AddressKind::abstract) address.sun_path[0] = '\0';
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + shown.size() +
                                             (kind == AddressKind::path ? 1 : 0));
    socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), size) != 0)
      throw std::runtime_error("cannot listen on " + shown + ": " + std::strerror(errno));
    setenv("NOTIFY_SOCKET", shown.c_str(), 1);
  }
  ~NotifySocket() {
    for (const char* variable : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"})
      unsetenv(variable);
    close(socket_);
    if (!path_.empty()) unlink(path_.c_str());
  }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  /// The next datagram; empty if none came within `patience_ms`.
  std::string next(int patience_ms = 0) {
    pollfd waiting{.fd = socket_, .events = POLLIN, .revents = 0};
    if (poll(&waiting, 1, patience_ms) <= 0) return {};
    std::array<char, 4096> buffer;
    const ssize_t size = recv(socket_, buffer.data(), buffer.size(), 0);
    return size > 0 ? std::string(buffer.data(), static_cast<std::size_t>(size)) : std::string();
  }

 private:
  std::string path_;
  int socket_ = -1;
};

}  // namespace softarm::test
