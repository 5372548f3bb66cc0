// Times as integers of nanoseconds: conversions from and to seconds, and the time that never comes.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

namespace softarm {

/// The arrival of what has not come yet: before every time of a clock.
inline constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();
/// The expiry of what does not expire: after every time of a clock.
inline constexpr std::int64_t kForever = std::numeric_limits<std::int64_t>::max();

/// Times in microseconds, off the wire or out of a log, count up to so far from zero on either side
/// (127 years): sums and differences of two of them fit into nanoseconds.
inline constexpr std::int64_t kLatest_us = 4'000'000'000'000'000;
inline bool is_time_us(std::int64_t time_us) noexcept {
  return time_us >= -kLatest_us && time_us <= kLatest_us;
}

/// How long ago `then_ns` was; for ever where it is kNever.
inline std::int64_t age_ns(std::int64_t now_ns, std::int64_t then_ns) noexcept {
  return then_ns == kNever ? kForever : now_ns - then_ns;
}

/// Seconds as nanoseconds, rounded to nearest; |seconds| below 9.2e9 (292 years).
inline std::int64_t to_ns(double seconds) noexcept { return std::llround(1e9 * seconds); }

/// Nanoseconds as seconds.
inline double to_seconds(std::int64_t nanoseconds) noexcept {
  return 1e-9 * static_cast<double>(nanoseconds);
}

}  // namespace softarm
