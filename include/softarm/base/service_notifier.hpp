// How a loop is doing, told to the service manager that started the program.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "softarm/base/time.hpp"

namespace softarm {

/// What a loop says of itself after each of its rounds.
struct ServiceReport {
  std::string_view state;   ///< of static storage, at most 60 characters
  std::string_view reason;  ///< the same; none if empty or "none"
  bool on_time = true;      ///< the round's deadline was kept
  bool stopping = false;    ///< a stop has begun
};

/// The protocol of sd_notify(3) and sd_watchdog_enabled(3) for systemd's Type=notify, without their
/// library. Belongs to one thread; after construction nothing allocates, waits or throws.
class ServiceNotifier {
 public:
  /// Reads NOTIFY_SOCKET (a path, or @ and the name of an abstract socket), WATCHDOG_USEC and
  /// WATCHDOG_PID. Without the first nothing is ever sent, without the second no WATCHDOG=1.
  ServiceNotifier();
  ~ServiceNotifier();
  ServiceNotifier(const ServiceNotifier&) = delete;
  ServiceNotifier& operator=(const ServiceNotifier&) = delete;

  /// Why nothing can be sent although NOTIFY_SOCKET is there; else empty.
  const std::string& problem() const noexcept { return problem_; }

  /// Sends what the manager does not know yet, in one datagram, or nothing: READY=1 with the first
  /// report, STATUS= when state or reason have changed, STOPPING=1 once, WATCHDOG=1 every
  /// WATCHDOG_USEC / 2 with a report that is on time. A manager whose queue is full is not waited
  /// for: what it missed goes with the next report.
  /// @param now_ns CLOCK_MONOTONIC
  void report(std::int64_t now_ns, const ServiceReport& report) noexcept;

 private:
  void open(std::string_view address);
  bool send(std::string_view text) const noexcept;

  std::string problem_;
  int socket_ = -1;
  alignas(std::int64_t) std::array<char, 112> address_{};  // a sockaddr_un
  unsigned address_size_ = 0;
  std::int64_t alive_every_ns_ = 0;  // 0: no watchdog
  // What the manager knows.
  bool ready_ = false, stopping_ = false;
  std::string_view state_, reason_;
  std::int64_t alive_ns_ = kNever;
};

}  // namespace softarm
