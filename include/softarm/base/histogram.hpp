// Durations counted in half-octaves: bounded, allocation-free, mergeable.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace softarm {

/// The lower edge of a bucket, 2^(bucket/2) us.
inline double bucket_edge_us(int bucket) noexcept {
  const auto octave = static_cast<double>(std::uint64_t{1} << (bucket / 2));
  return bucket % 2 == 0 ? octave : octave * 1.4142135623730951;
}

/// Number of buckets: the last one begins at 2^15.5 us = 46 ms.
inline constexpr int kDurationBuckets = 32;
/// How many durations fell into each bucket.
using DurationCounts = std::array<std::int64_t, kDurationBuckets>;

/// Upper edge, in us, of the bucket below which `fraction` (0 to 1) of the durations lie; 0 if
/// there are none.
inline double quantile_us(const DurationCounts& counts, double fraction) noexcept {
  std::int64_t total = 0;
  for (const auto count : counts) total += count;
  std::int64_t below = 0;
  for (int k = 0; k < kDurationBuckets; ++k) {
    below += counts[static_cast<std::size_t>(k)];
    if (total > 0 && static_cast<double>(below) >= fraction * static_cast<double>(total))
      return bucket_edge_us(k + 1);
  }
  return 0.0;
}

/// Bucket k counts durations from 2^(k/2) us to the lower edge of the next bucket; bucket 0 also
/// counts everything shorter, the last bucket everything longer.
class DurationHistogram {
 public:
  /// Counts one duration in ns.
  void add_ns(std::int64_t duration_ns) noexcept {
    ++counts_[static_cast<std::size_t>(bucket(duration_ns))];
    if (duration_ns > max_ns_) max_ns_ = duration_ns;
  }

  /// Counts of all buckets.
  const DurationCounts& counts() const noexcept { return counts_; }
  /// The longest duration so far, in us.
  double max_us() const noexcept { return 1e-3 * static_cast<double>(max_ns_); }

 private:
  static int bucket(std::int64_t duration_ns) noexcept {
    if (duration_ns < 1000) return 0;
    const auto us = static_cast<std::uint64_t>(duration_ns) / 1000;
    const int octave = static_cast<int>(std::bit_width(us)) - 1;
    const bool upper_half =
        static_cast<double>(duration_ns) * 1e-3 >= bucket_edge_us(2 * octave + 1);
    const int k = 2 * octave + (upper_half ? 1 : 0);
    return k < kDurationBuckets ? k : kDurationBuckets - 1;
  }

  DurationCounts counts_{};
  std::int64_t max_ns_ = 0;
};

}  // namespace softarm
