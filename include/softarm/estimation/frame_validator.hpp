// The gate between the wire and the estimator: which frames may be used.
#pragma once

#include <array>
#include <cstdint>

#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/estimation/settings.hpp"
#include "softarm/estimation/stale_bodies.hpp"

namespace softarm {

/// What became of a frame. Only `accepted` frames may be used.
enum class FrameVerdict {
  accepted,
  repeated,      ///< the number of the newest frame again
  out_of_order,  ///< an older number, or a capture time that is not later than the last accepted
                 ///< one
  sender_restarted,  ///< numbers began again; dropped, the next frame starts a new sequence
  wrong_size,        ///< not the number of segments of the arm
  not_finite,        ///< NaN or infinity in a body that claims to be valid
  bad_quaternion,    ///< norm off one by more than quaternion_tolerance
  bad_length,        ///< chord or pose of a segment that no bend explains: wrong or swapped bodies
  jump,              ///< u moved faster than max_speed_radps
  not_seen,          ///< no segment has both its ends
  bad_torsion        ///< a segment is turned about its own axis: a body recognised turned
};
inline constexpr int kFrameVerdicts = static_cast<int>(FrameVerdict::bad_torsion) + 1;

/// As above, in static storage; "unknown" for a value outside the enumeration.
const char* name(FrameVerdict verdict) noexcept;

/// Totals since construction.
struct FrameCounters {
  std::int64_t accepted = 0;
  std::int64_t repeated = 0;
  std::int64_t missing = 0;  ///< numbers left out between frames of one run of the sender
  std::int64_t out_of_order = 0;
  std::int64_t restarted = 0;
  std::int64_t wrong_size = 0;
  std::int64_t not_finite = 0;
  std::int64_t bad_quaternion = 0;
  std::int64_t bad_length = 0;
  std::int64_t jump = 0;
  std::int64_t not_seen = 0;
  std::int64_t bad_torsion = 0;
  std::int64_t stale = 0;  ///< accepted or not seen, with a body that repeats an old pose

  /// How often there was this verdict.
  std::int64_t of(FrameVerdict verdict) const noexcept;
  /// Every frame dropped for what it is; repeated frames are no fault and count apart.
  std::int64_t rejected() const noexcept {
    return out_of_order + restarted + wrong_size + not_finite + bad_quaternion + bad_length + jump +
           not_seen + bad_torsion;
  }
};

/// Judges one frame after the other. Reads no clock; a frame's own capture time is all the time it
/// knows. A body that was not seen, or only repeats an old pose (StaleBodies), makes the segments it
/// bounds unobserved, not the frame wrong. Allocates nothing after construction.
class FrameValidator {
 public:
  /// The estimator is copied; lengths and noise come from `arm` and `noise` as in
  /// CurvatureEstimator.
  /// @throws std::invalid_argument as CurvatureEstimator does, and for tolerances that are not
  /// positive and finite.
  FrameValidator(const EstimationSettings& settings, const ArmParameters& arm,
                 std::span<const BodyNoise> noise);

  /// Judges the next frame in order of arrival and counts it.
  FrameVerdict accept(const MocapFrame& frame, const CommandedMotion& commanded = {}) noexcept;

  /// The newest accepted frame; its stale bodies are not valid.
  const MocapFrame& newest() const noexcept { return last_; }

  /// u and residuals of the newest accepted frame.
  const CurvatureEstimate& estimate() const noexcept { return estimate_; }

  const FrameCounters& counters() const noexcept { return counters_; }

  /// Accepted frames in a row, up to the newest, whose poses equal those of the frame before bit by
  /// bit: 0 while the poses change. Whether that is a frozen sensor or an arm at rest is the safety
  /// monitor's question.
  std::int64_t identical_in_row() const noexcept { return identical_in_row_; }

  /// Forgets the past, keeps the counters: for a gap in which anything may have happened.
  void reset() noexcept;

 private:
  FrameVerdict judge(const MocapFrame& frame, const CommandedMotion& commanded) noexcept;
  FrameVerdict judge_number(std::int64_t number) noexcept;
  FrameVerdict judge_poses(const MocapFrame& frame) const noexcept;
  FrameVerdict judge_segments(const MocapFrame& frame) noexcept;
  FrameVerdict leave_out_stale_bodies(const MocapFrame& frame,
                                      const CommandedMotion& commanded) noexcept;
  void remember(const MocapFrame& frame) noexcept;

  EstimationSettings settings_;
  std::vector<double> length_m_;
  CurvatureEstimator estimator_;
  StaleBodies stale_;

  FrameCounters counters_;
  bool has_number_ = false;
  std::int64_t last_number_ = 0;
  std::int64_t last_old_number_ = 0;  // of the latest out-of-order frame
  int old_in_row_ = 0;                // out-of-order frames that count up among themselves

  bool has_frame_ = false;
  MocapFrame last_;  // newest accepted
  std::int64_t identical_in_row_ = 0;
  CurvatureEstimate estimate_;
  CurvatureEstimate candidate_;
  // Newest observation of every segment, for the jump check: a segment may have been unseen for
  // some frames.
  std::array<Eigen::Vector2d, kMaxSegments> seen_u_rad_;
  std::array<double, kMaxSegments> seen_variance_rad2_{};
  std::array<std::int64_t, kMaxSegments> seen_ns_{};
  std::array<bool, kMaxSegments> seen_{};
};

}  // namespace softarm
