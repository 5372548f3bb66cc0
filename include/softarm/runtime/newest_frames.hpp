// Bounds what a flood of frames costs the model-based observer in one tick.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/estimation/curvature_filter.hpp"
#include "softarm/estimation/mocap_frame.hpp"

namespace softarm {

/// The newest accepted frames of a tick with more frames than the observer may take, and what was
/// expected of the arm at their captures. Every frame costs the observer an update, about 10 us a
/// segment; all that one tick takes have half a period, with 50 us a segment and frame, so that a
/// processor five times slower keeps the period. At least one frame is taken. Allocates nothing
/// after construction.
class NewestFrames {
 public:
  static constexpr double kUpdate_s = 50e-6;  ///< a segment
  static constexpr int kMost = 16;

  /// How many frames the observer takes in one tick.
  static int most(int segments, double control_period_s) noexcept {
    return std::clamp(static_cast<int>(0.5 * control_period_s / (kUpdate_s * segments)), 1, kMost);
  }

  /// @param most 0: there is no observer, and nothing is kept
  explicit NewestFrames(int most) : kept_(static_cast<std::size_t>(most)) {}

  /// Whether a tick with `frames` frames is to `keep` and `take` them; else all may be taken at once.
  bool too_many(std::size_t frames) const noexcept {
    return frames > kept_.size() && !kept_.empty();
  }

  /// In order of arrival; the oldest is left out when there is no place.
  /// @param expected the motion expected at the capture, or null
  void keep(const MocapFrame& frame, const CurvatureEstimate& estimate,
            const KnownMotion* expected) noexcept {
    Kept& place = kept_[static_cast<std::size_t>(count_++) % kept_.size()];
    place.frame = frame;
    place.estimate = estimate;
    place.expects = expected != nullptr;
    if (expected != nullptr) place.expected = *expected;
  }

  /// Hands over what was kept, oldest first: take(frame, estimate, expected).
  template <class Take>
  void take(const Take& take) noexcept {
    const auto size = static_cast<std::int64_t>(kept_.size());
    const std::int64_t first = std::max<std::int64_t>(0, count_ - size);
    for (std::int64_t k = first; k < count_; ++k) {
      const Kept& it = kept_[static_cast<std::size_t>(k % size)];
      take(it.frame, it.estimate, it.expects ? &it.expected : nullptr);
    }
    left_out_ += first;
    count_ = 0;
  }

  /// Accepted frames that the observer did not take, since construction.
  std::int64_t left_out() const noexcept { return left_out_; }

 private:
  struct Kept {
    MocapFrame frame;
    CurvatureEstimate estimate;
    KnownMotion expected;
    bool expects = false;
  };
  std::vector<Kept> kept_;
  std::int64_t count_ = 0;  ///< of this tick
  std::int64_t left_out_ = 0;
};

}  // namespace softarm
