// Reports the health of a loop to the service manager that started the program.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "softarm/base/time.hpp"

namespace softarm {

/// The health of a loop after one round.
struct ServiceReport {
  std::string_view state;   ///< of static storage, at most 60 characters
  std::string_view reason;  ///< also of static storage; no reason if empty or "none"
  bool on_time = true;      ///< the round's deadline was kept
  bool stopping = false;    ///< the program is shutting down
};

/// The protocol of sd_notify(3) and sd_watchdog_enabled(3) for systemd's Type=notify, without
/// libsystemd. Use from one thread; after construction nothing allocates, waits or throws.
class ServiceNotifier {
 public:
  /// Reads NOTIFY_SOCKET (a path, or @ and the name of an abstract socket), WATCHDOG_USEC and
  /// WATCHDOG_PID. Without NOTIFY_SOCKET nothing is ever sent, without WATCHDOG_USEC no WATCHDOG=1.
  ServiceNotifier();
  ~ServiceNotifier();
  ServiceNotifier(const ServiceNotifier&) = delete;
  ServiceNotifier& operator=(const ServiceNotifier&) = delete;

  /// Why nothing can be sent although NOTIFY_SOCKET is set; otherwise empty.
  const std::string& problem() const noexcept { return problem_; }

  /// Sends what is new to the manager in one datagram, or nothing: READY=1 with the first report,
  /// STATUS= when state or reason have changed, STOPPING=1 once, WATCHDOG=1 every WATCHDOG_USEC / 2
  /// with a report that is on time. Does not wait for a manager whose queue is full: what it missed
  /// is sent with the next report.
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
  // What has been sent to the manager.
  bool ready_ = false, stopping_ = false;
  std::string_view state_, reason_;
  std::int64_t alive_ns_ = kNever;
};

}  // namespace softarm
