#include "softarm/base/realtime.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include <cerrno>
#include <cstddef>
#include <cstring>

namespace softarm {
namespace {

constexpr std::size_t kPrefaultedStack = std::size_t{256} * 1024;

/// A stack grows by page faults, even when memory is locked: this touches every page that a tick
/// may need in advance. Not inlined, or the caller would keep the array.
[[gnu::noinline]] void prefault_stack() noexcept {
  char pages[kPrefaultedStack];
  volatile char* const touched = pages;
  for (std::size_t at = 0; at < kPrefaultedStack; at += 1024) touched[at] = 0;
}

}  // namespace

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

}  // namespace softarm
