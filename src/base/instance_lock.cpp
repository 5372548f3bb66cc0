#include "softarm/base/instance_lock.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>

namespace softarm {

InstanceLock::InstanceLock(const std::string& name) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  // A leading zero byte makes the name abstract: it vanishes with the process, however it ends.
  const std::string full = "softarm." + name;
  const std::size_t length = std::min(full.size(), sizeof address.sun_path - 1);
  std::memcpy(address.sun_path + 1, full.data(), length);
  socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + length);
  if (socket_ < 0 || bind(socket_, reinterpret_cast<const sockaddr*>(&address), size) != 0) {
    const int error = errno;
    if (socket_ >= 0) close(socket_);
    if (error == EADDRINUSE)
      throw OtherInstance("another instance already serves " + name + "; stop it first");
    throw std::runtime_error("cannot lock " + name + ": " + std::strerror(error));
  }
}

InstanceLock::~InstanceLock() { close(socket_); }

}  // namespace softarm
