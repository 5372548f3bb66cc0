#include "softarm/base/clock.hpp"

#include <time.h>

namespace softarm {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

std::int64_t now_ns(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * kNsPerSecond + now.tv_nsec;
}

}  // namespace

std::int64_t monotonic_now_ns() noexcept { return now_ns(CLOCK_MONOTONIC); }

std::int64_t wall_now_ns() noexcept { return now_ns(CLOCK_REALTIME); }

void sleep_until_ns(std::int64_t deadline_ns) noexcept {
  const timespec deadline{.tv_sec = deadline_ns / kNsPerSecond,
                          .tv_nsec = deadline_ns % kNsPerSecond};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
}

}  // namespace softarm
