#include "softarm/estimation/clock_relation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {
constexpr std::int64_t kBucketNs = 200'000'000;

/// The remainder in [0, divisor), for times before zero too.
std::int64_t modulo(std::int64_t value, std::int64_t divisor) noexcept {
  return (value % divisor + divisor) % divisor;
}
}  // namespace

ClockRelation::ClockRelation(ClockMode mode, double latency_s)
    : mode_(mode), latency_ns_(to_ns(latency_s)) {
  if (!(latency_s >= 0.0) || !(latency_s < 1e6)) {
    throw std::invalid_argument(fmt::format("expected a latency >= 0 s, got {}", latency_s));
  }
}

void ClockRelation::reset() noexcept {
  bucket_.fill(Bucket{});
  has_stamp_ = false;
}

std::int64_t ClockRelation::capture_ns(std::int64_t arrival_ns, std::int64_t sender_us) noexcept {
  if (mode_ == ClockMode::latency || !is_time_us(sender_us)) {
    return arrival_ns - latency_ns_;
  }
  if (has_stamp_ && sender_us < last_sender_us_) {
    ++clock_jumps_;
    reset();
  }
  has_stamp_ = true;
  last_sender_us_ = sender_us;

  const std::int64_t sender_ns = 1000 * sender_us;
  const std::int64_t offset_ns = arrival_ns - sender_ns;
  const std::int64_t period = (arrival_ns - modulo(arrival_ns, kBucketNs)) / kBucketNs;
  Bucket& newest = bucket_[static_cast<std::size_t>(modulo(period, kBuckets))];
  newest = newest.period == period ? Bucket{period, std::min(newest.least_ns, offset_ns)}
                                   : Bucket{period, offset_ns};
  std::int64_t least_ns = offset_ns;
  for (const Bucket& bucket : bucket_) {
    if (bucket.period > period - kBuckets && bucket.period <= period) {
      least_ns = std::min(least_ns, bucket.least_ns);
    }
  }
  return sender_ns + least_ns - latency_ns_;
}

}  // namespace softarm
