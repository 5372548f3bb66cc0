#include "softarm/base/service_notifier.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <new>

namespace softarm {
namespace {

constexpr std::size_t kLongestWord = 60;

/// The positive integer in an environment variable; 0 where there is none.
std::int64_t positive(const char* variable) {
  const char* text = std::getenv(variable);
  if (text == nullptr) return 0;
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text, text + std::strlen(text), value);
  return error == std::errc() && *end == '\0' ? std::max<std::int64_t>(value, 0) : 0;
}

/// Appends lines to a preallocated buffer.
class Message {
 public:
  void add(std::string_view part) noexcept {
    const std::size_t count = std::min(part.size(), text_.size() - size_);
    size_ += part.copy(text_.data() + size_, count);
  }
  std::string_view text() const noexcept { return {text_.data(), size_}; }

 private:
  std::array<char, 256> text_;
  std::size_t size_ = 0;
};

}  // namespace

ServiceNotifier::ServiceNotifier() {
  const char* address = std::getenv("NOTIFY_SOCKET");
  if (address == nullptr || *address == '\0') return;
  open(address);
  constexpr std::int64_t kLongestPeriod_us = 1'000'000'000'000;
  const bool for_another =
      std::getenv("WATCHDOG_PID") != nullptr && positive("WATCHDOG_PID") != getpid();
  if (!for_another)
    alive_every_ns_ = std::min(positive("WATCHDOG_USEC"), kLongestPeriod_us) * 1000 / 2;
}

ServiceNotifier::~ServiceNotifier() {
  if (socket_ >= 0) close(socket_);
}

void ServiceNotifier::open(std::string_view address) {
  static_assert(sizeof(sockaddr_un) <= sizeof address_);
  auto* const to = new (address_.data()) sockaddr_un{};
  const bool abstract = address.front() == '@';
  // A path needs space for its terminating zero.
  if ((!abstract && address.front() != '/') ||
      address.size() + (abstract ? 0 : 1) > sizeof to->sun_path) {
    problem_ =
        "cannot notify the service manager: NOTIFY_SOCKET is neither a path nor an @name of up "
        "to " +
        std::to_string(sizeof to->sun_path) + " characters: " + std::string(address);
    return;
  }
  to->sun_family = AF_UNIX;
  address.copy(to->sun_path, address.size());
  if (abstract) to->sun_path[0] = '\0';
  address_size_ =
      static_cast<unsigned>(offsetof(sockaddr_un, sun_path) + address.size() + (abstract ? 0 : 1));
  socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ < 0)
    problem_ = std::string("cannot notify the service manager: ") + std::strerror(errno);
}

void ServiceNotifier::report(std::int64_t now_ns, const ServiceReport& report) noexcept {
  if (socket_ < 0) return;
  const bool changed = report.state != state_ || report.reason != reason_;
  const bool alive =
      alive_every_ns_ > 0 && report.on_time && age_ns(now_ns, alive_ns_) >= alive_every_ns_;
  Message message;
  if (!ready_) message.add("READY=1\n");
  if (report.stopping && !stopping_) message.add("STOPPING=1\n");
  if (changed) {
    message.add("STATUS=");
    message.add(report.state.substr(0, kLongestWord));
    if (!report.reason.empty() && report.reason != "none") {
      message.add(" (");
      message.add(report.reason.substr(0, kLongestWord));
      message.add(")");
    }
    message.add("\n");
  }
  if (alive) message.add("WATCHDOG=1\n");
  if (message.text().empty() || !send(message.text())) return;
  ready_ = true;
  stopping_ = stopping_ || report.stopping;
  state_ = report.state;
  reason_ = report.reason;
  if (alive) alive_ns_ = now_ns;
}

bool ServiceNotifier::send(std::string_view text) const noexcept {
  return sendto(socket_, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                reinterpret_cast<const sockaddr*>(address_.data()),
                address_size_) == static_cast<ssize_t>(text.size());
}

}  // namespace softarm
