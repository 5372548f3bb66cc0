// When was a frame captured, on our monotonic clock?
#pragma once

#include <array>
#include <cstdint>

#include "softarm/base/time.hpp"

namespace softarm {

/// What a capture time is reckoned from.
enum class ClockMode {
  sender,  ///< the sender's time stamps; the offset to our clock is learnt from the earliest
           ///< arrivals
  latency  ///< the arrival; the sender's time stamps are not looked at
};

/// Relates the sender's clock to ours. In `sender` mode the offset is the smallest (arrival -
/// stamp) of the last two seconds: a frame can come late, never early, so the smallest belongs to a
/// frame with nothing but the least latency.
///  - Jitter of the network drops out; a drift between the clocks of 100 ppm costs at most 0.2 ms.
///  - A sender's clock set forward is followed at once. Set back, its stamps run backwards, and the
///  relation starts
///    again; a step back of less than a frame period is not seen and makes frames that much older
///    for two seconds.
///  - Until the window has seen an undelayed frame, captures come out too late by the least delay
///  so far.
/// Never yields a capture after the arrival. Bounded storage; noexcept; allocates nothing.
class ClockRelation {
 public:
  /// `latency_s`: declared time from capture to the earliest arrival; not negative.
  /// @throws std::invalid_argument where it is negative or not finite.
  ClockRelation(ClockMode mode, double latency_s);

  /// Capture time in ns on our clock of a frame that arrived at `arrival_ns` (our clock, not
  /// decreasing from call to call) with the sender's stamp `sender_us`. A stamp beyond +-4e15 us is
  /// nonsense; latency mode is used for it.
  std::int64_t capture_ns(std::int64_t arrival_ns, std::int64_t sender_us) noexcept;

  /// Forgets what was learnt: for a gap in which anything may have happened.
  void reset() noexcept;

  /// Times the relation started again because stamps ran backwards.
  std::int64_t clock_jumps() const noexcept { return clock_jumps_; }

 private:
  static constexpr int kBuckets = 10;
  struct Bucket {
    std::int64_t period = kNever;  // number of the bucket's 0.2 s on our clock
    std::int64_t least_ns = 0;
  };

  ClockMode mode_;
  std::int64_t latency_ns_;
  std::array<Bucket, kBuckets> bucket_;
  bool has_stamp_ = false;
  std::int64_t last_sender_us_ = 0;
  std::int64_t clock_jumps_ = 0;
};

}  // namespace softarm
