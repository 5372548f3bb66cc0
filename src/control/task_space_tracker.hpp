// (21) online: from a path of the tip and its measured place to u_ref, u'_ref, u''_ref.
#pragma once

#include <Eigen/Core>

#include "control/blend.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/control/settings.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// Integrates u''_ref = J^+ (p_d'' + 2 L (p_d' - p') + L^2 (p_d - p) - J' u'_ref) + null-space
/// part, the second line of (21) as corrected, L = lambda, J at the reference state, damped near
/// singular configurations (`damped_inverse`). u_ref, u'_ref, u''_ref belong together exactly.
///
/// p is the measured tip. It comes late and noisy, so what is filtered is only how far it is off
/// the model's tip of the reference, d = p - f(u_ref), as a line in time; p and p' above are
/// f(u_ref) + d and J u'_ref + d' now. An arm that follows its reference leaves d alone: the loop
/// that is closed over the arm is that of d, whatever lambda is.
///
/// Null space: u'' = -2 L (u' + r u), r the posture rate: the posture drifts to less bend at rate r
/// and nothing circulates. The same damps directions in which J is nearly singular.
///
/// Bounds: the tip error that is acted on is at most a quarter of the arm's length; |u'| of a
/// segment stays within max_speed_radps and theta within 0.97 max_theta_rad. For a path out of
/// reach the arm thus comes to rest stretched out towards it. All times in s, one clock.
class TaskSpaceTracker {
 public:
  TaskSpaceTracker(const ArmParameters& arm, const ControllerSettings& control,
                   const ReferenceKind& path);

  /// From u, velocity (2n) at `time_s`, where the path begins. The path is joined from where the
  /// tip is by a quintic in blend_s. @param tip_offset_m d there.
  void start(double time_s, ConstVectorRef u, ConstVectorRef velocity,
             const Eigen::Vector3d& tip_offset_m) noexcept;

  /// A measurement of the tip (world frame) at `time_s`, in the past. Not later than the last one:
  /// it is ignored.
  void measure(double time_s, const Eigen::Vector3d& tip_m) noexcept;

  /// Integrates up to `time_s`; at most kMaxSteps steps, longer ones after a long pause.
  void advance(double time_s) noexcept;

  /// u_ref and its derivatives near the time advanced to, u''_ref constant; the vectors of `out`
  /// must have their size. Sets `tip` and `limited` too.
  void sample(double time_s, ReferenceSample& out) const noexcept;

  double time_s() const noexcept { return time_s_; }

  static constexpr int kMaxSteps = 20;

 private:
  void accelerate() noexcept;
  void step(double duration_s) noexcept;
  void bound(double duration_s) noexcept;
  TipReference target(double time_s) noexcept;
  Eigen::Vector3d offset(double time_s) const noexcept;

  ArmParameters arm_;
  TaskSpaceSettings gains_;
  ReferenceKind path_;
  double blend_s_, max_theta_rad_, max_speed_radps_, reach_m_;

  double begin_s_ = 0.0, time_s_ = 0.0;
  SegmentVector u_, velocity_, acceleration_;
  bool limited_ = false;
  Blend join_;
  double offset_time_s_ = 0.0;
  Eigen::Vector3d offset_m_ = Eigen::Vector3d::Zero(), offset_rate_mps_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd jacobian_, jacobian_rate_;
  SegmentVector posture_;
  ReferenceSample blended_;
};

}  // namespace softarm
