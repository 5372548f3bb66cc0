// A network for a test.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdio>
#include <string>

namespace softarm::test {

/// Whether no other test has this port. It stays taken, by a name of the kernel, until this process
/// ends; processes that it starts do not keep it.
inline bool take_port(int port) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;  // an abstract name begins with a zero
  std::snprintf(name.sun_path + 1, sizeof name.sun_path - 1, "softarm_test_port_%d", port);
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (::bind(socket, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0) return true;
  close(socket);
  return false;
}

/// An LCM URL that does not leave the machine, with a different port for every process and call, so
/// that tests may run side by side. The ports are below those that the system gives to sockets.
inline std::string own_url() {
  static int calls = 0;
  constexpr int kPorts = 12000;
  int port = 0;
  do {
    port = 20000 + (8 * getpid() + calls++) % kPorts;
  } while (!take_port(port) && calls < kPorts);
  return "udpm://239.255.76.67:" + std::to_string(port) + "?ttl=0";
}

}  // namespace softarm::test
