// Simulated motion capture: from true poses to the frames that a controller receives, late, noisy
// and incomplete.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "softarm/base/time.hpp"
#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/simulation/random.hpp"
#include "softarm/simulation/settings.hpp"

namespace softarm {

/// Captures frames at a fixed rate and hands each out after its latency. Time is an argument; frame
/// k is captured at start + round(k 1e9 / rate) ns, so that the rate does not drift. Same seed,
/// same frames, bit for bit; noise and dropouts draw from separate sequences, so switching one does
/// not change the other.
class MocapSimulator {
 public:
  /// @param segments number of measured segment ends, 1..kMaxSegments.
  /// @param start_ns time of the first capture.
  /// @throw std::invalid_argument for a rate outside (0, 1e6] Hz, a negative or not finite latency
  /// or noise, a latency of
  ///        more than 1e5 frames, a dropout probability outside [0, 1], a wrong number of segments.
  MocapSimulator(const MocapSettings& settings, int segments, std::uint64_t seed,
                 std::int64_t start_ns);

  std::int64_t next_capture_ns() const noexcept { return next_capture_ns_; }

  /// Takes the frame due at `next_capture_ns()`: body 0 is the base, body i the end of segment i,
  /// all in the world frame. A frame that drops out still counts in the frame numbers.
  void capture(const Eigen::Isometry3d& base,
               std::span<const Eigen::Isometry3d> segment_ends) noexcept;

  /// When the oldest frame under way arrives; kForever if there is none.
  std::int64_t next_arrival_ns() const noexcept;

  /// The oldest frame that has arrived by `now_ns`, if any, in order of capture. Frames that
  /// are not fetched are lost oldest first once the queue (as many as the latency needs, plus
  /// kSlack) is full.
  bool receive(std::int64_t now_ns, MocapFrame& frame) noexcept;

  std::int64_t captured() const noexcept { return captured_; }  ///< frames, dropped ones included
  std::int64_t dropped() const noexcept { return dropped_; }    ///< frames that dropped out
  std::int64_t overwritten() const noexcept { return overwritten_; }  ///< frames not fetched

  static constexpr int kSlack = 16;  ///< frames that may wait to be fetched

 private:
  BodyPose sense(const Eigen::Isometry3d& pose, bool noisy) noexcept;
  void schedule() noexcept;

  MocapSettings settings_;
  int segments_;
  std::int64_t start_ns_;
  std::int64_t latency_ns_;
  std::int64_t next_capture_ns_;
  std::int64_t captured_ = 0;
  std::int64_t dropped_ = 0;
  std::int64_t overwritten_ = 0;
  RandomNumbers noise_;
  RandomNumbers dropouts_;
  std::vector<MocapFrame> queue_;  // a ring
  std::size_t oldest_ = 0;
  std::size_t waiting_ = 0;
};

}  // namespace softarm
