#include "softarm/base/clock.hpp"

#include <time.h>

#include <algorithm>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr std::int64_t kTogether_ns = 5000;
constexpr int kAttempts = 4;

std::int64_t read_ns(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * kNsPerSecond + now.tv_nsec;
}

}  // namespace

std::int64_t monotonic_now_ns() noexcept { return read_ns(CLOCK_MONOTONIC); }

ClockPair read_clocks() noexcept {
  ClockPair best{};
  std::int64_t least_ns = kForever;
  std::int64_t before_ns = monotonic_now_ns();
  for (int attempt = 0; attempt < kAttempts && least_ns > kTogether_ns; ++attempt) {
    const std::int64_t wall_ns = read_ns(CLOCK_REALTIME), after_ns = monotonic_now_ns();
    if (after_ns - before_ns < least_ns) best = {after_ns, wall_ns};
    least_ns = std::min(least_ns, after_ns - before_ns);
    before_ns = after_ns;
  }
  return best;
}

void sleep_until_ns(std::int64_t deadline_ns) noexcept {
  const timespec deadline{.tv_sec = deadline_ns / kNsPerSecond,
                          .tv_nsec = deadline_ns % kNsPerSecond};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
}

}  // namespace softarm
