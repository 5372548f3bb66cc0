// CLOCK_BOOTTIME of the test program itself, which a test lets run ahead: as after a suspend. Weak,
// so that several files of a test program may include this.
#pragma once

#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>

namespace softarm::test {
inline std::atomic<std::int64_t> suspended_ns{0};
}  // namespace softarm::test

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SOFTARM_SETS_CLOCK 1
extern "C" [[gnu::weak]] int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const auto result = static_cast<int>(syscall(SYS_clock_gettime, clock, time));
  if (result == 0 && clock == CLOCK_BOOTTIME) {
    const std::int64_t ns = time->tv_nsec + softarm::test::suspended_ns;
    time->tv_sec += ns / 1'000'000'000;
    time->tv_nsec = ns % 1'000'000'000;
  }
  return result;
}
#endif
