#include "softarm/base/instance_lock.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>

#include "softarm/base/hash.hpp"

namespace softarm {
namespace {

constexpr std::size_t kLongest = sizeof sockaddr_un{}.sun_path - 1;

/// The name itself, or, where it is too long for a socket, its beginning and the hash of the whole.
std::string fitting(const std::string& name) {
  if (name.size() <= kLongest) return name;
  const std::string hash = fmt::format("#{:016x}", fnv1a(name));
  return name.substr(0, kLongest - hash.size()) + hash;
}

}  // namespace

InstanceLock::InstanceLock(const std::string& name) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  // A leading zero byte makes the name abstract: it vanishes with the process, however it ends.
  const std::string full = fitting("softarm." + name);
  std::memcpy(address.sun_path + 1, full.data(), full.size());
  socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + full.size());
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
