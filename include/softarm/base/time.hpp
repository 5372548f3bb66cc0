// Times as integer nanoseconds: conversion from and to seconds, and the times "never" and
// "forever".
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

namespace softarm {

/// The arrival time of what has not arrived yet: before every time of a clock.
inline constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();
/// The expiry time of what does not expire: after every time of a clock.
inline constexpr std::int64_t kForever = std::numeric_limits<std::int64_t>::max();

/// Largest magnitude of a time in microseconds that is accepted from the wire or from a log (127
/// years): sums and differences of two such times fit into 64-bit nanoseconds.
inline constexpr std::int64_t kLatest_us = 4'000'000'000'000'000;
/// In place of a time that is none: no clock relation takes it.
inline constexpr std::int64_t kNoTime_us = kLatest_us + 1;
/// The nearest microsecond; kNoTime_us where `time_s` is not within +-kLatest_us.
inline std::int64_t to_us(double time_s) noexcept {
  const double time_us = 1e6 * time_s;
  return std::abs(time_us) <= static_cast<double>(kLatest_us) ? std::llround(time_us) : kNoTime_us;
}
/// Whether `time_us` is within +-kLatest_us.
inline bool is_time_us(std::int64_t time_us) noexcept {
  return time_us >= -kLatest_us && time_us <= kLatest_us;
}

/// How long before `now_ns` `then_ns` was, in ns; kForever where it is kNever.
inline std::int64_t age_ns(std::int64_t now_ns, std::int64_t then_ns) noexcept {
  return then_ns == kNever ? kForever : now_ns - then_ns;
}

/// Seconds to nanoseconds, rounded to nearest; |seconds| must be below 9.2e9 (292 years).
inline std::int64_t to_ns(double seconds) noexcept { return std::llround(1e9 * seconds); }

/// Nanoseconds to seconds.
inline double to_seconds(std::int64_t nanoseconds) noexcept {
  return 1e-9 * static_cast<double>(nanoseconds);
}

}  // namespace softarm
