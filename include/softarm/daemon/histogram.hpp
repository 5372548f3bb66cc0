// Durations counted in half-octaves: bounded, allocation-free, mergeable.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace softarm {

/// Bucket k counts durations from 2^(k/2) us up to the next; bucket 0 also everything shorter, the
/// last everything longer.
class DurationHistogram {
 public:
  static constexpr int kBuckets = 32;

  void add_ns(std::int64_t duration_ns) noexcept {
    ++counts_[static_cast<std::size_t>(bucket(duration_ns))];
    ++total_;
    if (duration_ns > max_ns_) max_ns_ = duration_ns;
  }

  /// Upper edge, in us, of the bucket below which `fraction` of the durations lie; 0 when empty.
  double quantile_us(double fraction) const noexcept {
    const double wanted = fraction * static_cast<double>(total_);
    std::int64_t below = 0;
    for (int k = 0; k < kBuckets; ++k) {
      below += counts_[static_cast<std::size_t>(k)];
      if (static_cast<double>(below) >= wanted && total_ > 0) return lower_edge_us(k + 1);
    }
    return 0.0;
  }

  const std::array<std::int32_t, kBuckets>& counts() const noexcept { return counts_; }
  std::int64_t max_ns() const noexcept { return max_ns_; }

  /// 2^(bucket/2) us.
  static double lower_edge_us(int bucket) noexcept {
    const auto octave = static_cast<double>(std::uint64_t{1} << (bucket / 2));
    return bucket % 2 == 0 ? octave : octave * 1.4142135623730951;
  }

 private:
  static int bucket(std::int64_t duration_ns) noexcept {
    if (duration_ns < 1000) return 0;
    const auto us = static_cast<std::uint64_t>(duration_ns) / 1000;
    const int octave = std::bit_width(us) - 1;
    const bool upper_half =
        static_cast<double>(duration_ns) * 1e-3 >= lower_edge_us(2 * octave + 1);
    const int k = 2 * octave + (upper_half ? 1 : 0);
    return k < kBuckets ? k : kBuckets - 1;
  }

  std::array<std::int32_t, kBuckets> counts_{};
  std::int64_t total_ = 0;
  std::int64_t max_ns_ = 0;
};

}  // namespace softarm
