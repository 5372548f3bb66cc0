#include "softarm/base/clock.hpp"

#include <algorithm>

namespace softarm {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

timespec to_timespec(std::int64_t time_ns) noexcept {
  return {.tv_sec = time_ns / kNsPerSecond, .tv_nsec = time_ns % kNsPerSecond};
}

std::int64_t now_ns(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * kNsPerSecond + now.tv_nsec;
}

}  // namespace

std::int64_t monotonic_now_ns() noexcept { return now_ns(CLOCK_MONOTONIC); }
std::int64_t wall_now_ns() noexcept { return now_ns(CLOCK_REALTIME); }
std::int64_t thread_cpu_ns() noexcept { return now_ns(CLOCK_THREAD_CPUTIME_ID); }

void sleep_until_ns(std::int64_t deadline_ns) noexcept {
  const timespec deadline = to_timespec(deadline_ns);
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
}

timespec time_left(std::int64_t deadline_ns) noexcept {
  return to_timespec(std::max<std::int64_t>(0, deadline_ns - monotonic_now_ns()));
}

}  // namespace softarm
