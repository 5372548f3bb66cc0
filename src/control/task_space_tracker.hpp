// (21) online: from a path of the tip and its measured place to u_ref, u'_ref, u''_ref.
#pragma once

#include <Eigen/Core>

#include "control/blend.hpp"
#include "control/tip_offset.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/control/settings.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// Integrates u''_ref = J^+ (p_d'' - d'' + 2 L (p_d' - p') + L^2 (p_d - p) - J' u'_ref) +
/// null-space part, the second line of (21) as corrected, L = lambda, J at the reference state,
/// damped near singular configurations (`damped_inverse`). u_ref, u'_ref, u''_ref belong together
/// exactly.
///
/// p is where the tip is bound to be, f(u_ref) + d: the model's tip of the reference plus the offset
/// of the measured tip, as TipOffset finds it. The integration follows the model alone and is fast;
/// what is closed over the arm is the loop of d, and that is slow. An arm that follows its reference
/// leaves d alone, however late it is measured.
///
/// Null space: u'' = -2 L (u' + r u), r the posture rate: the posture drifts to less bend at rate r
/// and nothing circulates. The same damps directions in which J is nearly singular.
///
/// Where segments stretch, the same in (u, e) with J^# = W J'(J W J')^-1 in place of J^+: W, the inverse
/// of the stiffnesses, makes it the least elastic rate, and rad and m comparable. e drifts to its
/// natural value. W = I otherwise, and with equal bending stiffness in u.
///
/// Bounds: the tip error that is acted on is at most a quarter of the arm's length; |u'| of a
/// segment stays within max_speed_radps and theta within 0.97 max_theta_rad. For a path out of
/// reach the arm thus comes to rest stretched out towards it. All times in s, one clock.
class TaskSpaceTracker {
 public:
  /// @param natural_elongation_m n, of segments that stretch; otherwise not read
  TaskSpaceTracker(const ArmParameters& arm, const ControllerSettings& control,
                   const ReferenceKind& path, const SegmentScalars& natural_elongation_m);

  /// From u, velocity (2n) at `time_s`, where the path begins. The path is joined from where the
  /// tip is by a quintic in blend_s. @param tip_offset_m d there.
  void start(double time_s, ConstVectorRef u, ConstVectorRef velocity,
             const Eigen::Vector3d& tip_offset_m) noexcept;

  /// A measurement of the tip (world frame) at `time_s`, in the past. Not later than the last one:
  /// it is ignored.
  void measure(double time_s, const Eigen::Vector3d& tip_m) noexcept;

  /// Integrates up to `time_s`; at most kMaxSteps steps, longer ones after a long pause.
  void advance(double time_s) noexcept;

  /// u_ref and its derivatives near the time advanced to, with the jerk of the last 10 ms: the
  /// inverse of the valve lag needs it; without its B u'''_ref it makes the tip's loop unstable. The
  /// vectors of `out` must have their size. Sets `tip` and `limited` too.
  void sample(double time_s, ReferenceSample& out) const noexcept;

  double time_s() const noexcept { return time_s_; }
  const SegmentVector& u_rad() const noexcept { return u_; }
  double reach_m() const noexcept { return reach_m_; }

  /// Whether the path is a live target.
  bool live() const noexcept { return live_ != nullptr; }
  /// A new live target at `time_s`.
  void retarget(double time_s, const Eigen::Vector3d& position_m,
                const Eigen::Vector3d& velocity_mps) noexcept;

  /// From now on theta of every segment also stays within what its chambers can hold.
  void hold_within(HoldLimits& limits) noexcept { hold_ = &limits; }

  static constexpr int kMaxSteps = 20;

 private:
  void weigh(const SegmentScalars& natural_elongation_m);
  void accelerate() noexcept;
  void step(double duration_s) noexcept;
  void bound(double duration_s) noexcept;
  TipReference target(double time_s) noexcept;
  TipReference path(double time_s) const noexcept;
  TipReference from_base(TipReference path) const noexcept {
    path.position_m -= arm_.base_position_m;
    return path;
  }

  ArmParameters arm_;
  TaskSpaceSettings gains_;
  ReferenceKind path_;
  const LiveTipReference* live_;  ///< of path_, where it is live
  double blend_s_, max_theta_rad_, max_speed_radps_, reach_m_;

  double begin_s_ = 0.0, time_s_ = 0.0;
  SegmentVector u_, velocity_, acceleration_, jerk_;
  bool limited_ = false;
  Blend join_;
  // A live target: where it was sent to go, and what is left of where it was.
  double live_s_ = 0.0, stop_s_ = 0.0;
  Eigen::Vector3d live_m_ = Eigen::Vector3d::Zero(), live_mps_ = live_m_;
  Blend approach_, stop_;
  HoldLimits* hold_ = nullptr;
  SegmentVector largest_bend_;
  TipOffset offset_;
  Eigen::Matrix3Xd jacobian_, jacobian_rate_;
  SegmentVector posture_;
  SegmentVector rest_;   ///< of the posture, where segments stretch; otherwise empty
  SegmentVector scale_;  ///< sqrt W, likewise
  double hard_mprad_;    ///< J is damped below
  mutable ReferenceSample blended_;
};

}  // namespace softarm
