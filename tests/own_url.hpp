// A network for a test.
#pragma once

#include <unistd.h>

#include <string>

namespace softarm::test {

/// An LCM URL that does not leave the machine, with a different port for every process and call, so
/// that tests may run side by side. The ports are below those that the system gives to sockets.
inline std::string own_url() {
  static int calls = 0;
  return "udpm://239.255.76.67:" + std::to_string(20000 + (8 * getpid() + calls++) % 12000) +
         "?ttl=0";
}

}  // namespace softarm::test
