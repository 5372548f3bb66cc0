#include "softarm/base/clock.hpp"

#include <algorithm>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr std::int64_t kTogether_ns = 5000;
constexpr int kAttempts = 4;
/// Both clocks count the same oscillator; no suspend is as short as this.
constexpr std::int64_t kShortestPause_ns = 1'000'000;

timespec to_timespec(std::int64_t time_ns) noexcept {
  return {.tv_sec = time_ns / kNsPerSecond, .tv_nsec = time_ns % kNsPerSecond};
}

std::int64_t read_ns(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * kNsPerSecond + now.tv_nsec;
}

}  // namespace

std::int64_t monotonic_now_ns() noexcept { return read_ns(CLOCK_MONOTONIC); }
std::int64_t wall_now_ns() noexcept { return read_ns(CLOCK_REALTIME); }
std::int64_t thread_cpu_ns() noexcept { return read_ns(CLOCK_THREAD_CPUTIME_ID); }

ClockPair read_clocks() noexcept {
  ClockPair best{};
  std::int64_t least_ns = kForever;
  std::int64_t before_ns = monotonic_now_ns();
  for (int attempt = 0; attempt < kAttempts && least_ns > kTogether_ns; ++attempt) {
    const std::int64_t wall_ns = wall_now_ns(), after_ns = monotonic_now_ns();
    if (after_ns - before_ns < least_ns) best = {after_ns, wall_ns};
    least_ns = std::min(least_ns, after_ns - before_ns);
    before_ns = after_ns;
  }
  return best;
}

PauseWatch::Difference PauseWatch::read() noexcept {
  const std::int64_t before_ns = monotonic_now_ns(), boot_ns = read_ns(CLOCK_BOOTTIME);
  return {boot_ns - monotonic_now_ns(), boot_ns - before_ns};
}

PauseWatch::PauseWatch() noexcept : known_(read()) {}

bool PauseWatch::paused() noexcept {
  const Difference now = read();
  const bool changed = now.least_ns > known_.most_ns + kShortestPause_ns ||
                       now.most_ns < known_.least_ns - kShortestPause_ns;
  if (changed) {
    known_ = now;
  } else {  // what both readings allow
    known_ = {std::max(known_.least_ns, now.least_ns), std::min(known_.most_ns, now.most_ns)};
  }
  return changed;
}

void sleep_until_ns(std::int64_t deadline_ns) noexcept {
  const timespec deadline = to_timespec(deadline_ns);
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
}

timespec time_left(std::int64_t deadline_ns) noexcept {
  return to_timespec(std::max<std::int64_t>(0, deadline_ns - monotonic_now_ns()));
}

}  // namespace softarm
