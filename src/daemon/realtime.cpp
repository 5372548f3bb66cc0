#include "softarm/daemon/realtime.hpp"

#include <arpa/inet.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string_view>

namespace softarm {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr std::size_t kPrefaultedStack = std::size_t{256} * 1024;

/// A stack grows by page faults, also when memory is locked: every page that a tick may need is
/// touched before. Not inlined, or the caller would keep the array.
[[gnu::noinline]] void prefault_stack() noexcept {
  char pages[kPrefaultedStack];
  volatile char* const touched = pages;
  for (std::size_t at = 0; at < kPrefaultedStack; at += 1024) touched[at] = 0;
}

}  // namespace

std::int64_t monotonic_now_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * kNsPerSecond + now.tv_nsec;
}

void sleep_until_ns(std::int64_t deadline_ns) noexcept {
  const timespec deadline{.tv_sec = deadline_ns / kNsPerSecond,
                          .tv_nsec = deadline_ns % kNsPerSecond};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
}

std::vector<std::string> apply_realtime_settings(const RealtimeSettings& settings) {
  std::vector<std::string> refused;
  // Without SCHED_FIFO Linux may wake a sleeper 50 us late, to spare wake-ups.
  prctl(PR_SET_TIMERSLACK, 1);
  if (settings.cpu >= 0) {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    CPU_SET(static_cast<std::size_t>(settings.cpu), &cpus);
    if (const int error = pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus); error != 0)
      refused.push_back("cannot pin the tick to CPU " + std::to_string(settings.cpu) + ": " +
                        std::strerror(error) +
                        "; choose daemon.realtime.cpu among the CPUs of this machine");
  }
  if (settings.lock_memory) {
    if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0)
      refused.push_back(
          std::string("cannot lock memory: ") + std::strerror(errno) +
          "; run as root or raise the limit (ulimit -l unlimited, LimitMEMLOCK=infinity)");
    prefault_stack();
  }
  if (settings.fifo) {
    const sched_param parameter{.sched_priority = settings.priority};
    if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter); error != 0)
      refused.push_back("cannot use SCHED_FIFO at priority " + std::to_string(settings.priority) +
                        ": " + std::strerror(error) +
                        "; run as root or raise the limit (ulimit -r, LimitRTPRIO=)");
  }
  return refused;
}

bool runs_under_fifo() noexcept {
  int policy = 0;
  sched_param parameter{};
  return pthread_getschedparam(pthread_self(), &policy, &parameter) == 0 && policy == SCHED_FIFO;
}

std::string lock_name(const std::string& channel, const std::string& url) {
  constexpr std::string_view kUdp = "udpm://";
  std::string network = url.substr(0, url.find('?'));
  if (network.starts_with(kUdp)) {
    // As LCM 1.3.1 reads it.
    std::string text = network.substr(kUdp.size());
    if (text.empty()) text = "239.255.76.67:7667";
    const std::size_t colon = text.find(':');
    in_addr address{};
    if (inet_aton(text.substr(0, colon).c_str(), &address) == 1) {
      std::array<char, INET_ADDRSTRLEN> digits{};
      inet_ntop(AF_INET, &address, digits.data(), digits.size());
      const long port = colon < text.size() ? std::strtol(text.c_str() + colon + 1, nullptr, 0) : 0;
      network = std::string(kUdp) + digits.data() + ":" + std::to_string(port);
    }
  }
  return channel + " on " + network;
}

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
