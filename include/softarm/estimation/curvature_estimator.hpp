// From the poses of a frame to the curvature u of every segment: (19), and (20) in the form that
// holds on [0, 2 pi).
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <span>
#include <vector>

#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/estimation/settings.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// Standard deviations of one measured body; zero for a base that is fixed by configuration.
struct BodyNoise {
  double position_m = 0.0;       ///< of the position, an axis
  double orientation_rad = 0.0;  ///< of the rotation vector, an axis
};

/// Noise of the n + 1 bodies of an arm, all alike, the base without noise where it is fixed.
std::vector<BodyNoise> body_noise(const EstimationSettings& settings, int segments);

/// What one frame says about every segment.
struct CurvatureEstimate {
  int segments = 0;
  SegmentVector u_rad;  ///< 2n; [theta cos phi, theta sin phi] of every segment
  /// Variance of u along the bending direction, first order in the noise of both bodies. Across it
  /// the variance is this over sinc(theta / 2)^2: the same at 0, without bound towards theta = 2
  /// pi, where phi means nothing.
  std::array<double, kMaxSegments> variance_rad2{};
  /// Rotation about the segment's own axis, from q_z, in [-pi, pi]; zero for a PCC segment. Blind
  /// at theta = pi.
  std::array<double, kMaxSegments> twist_rad{};
  /// Rotation about the chord that a PCC segment with this chord does not have, in [-pi, pi]: the
  /// same, but not blind at any theta with a chord. It is twist_rad where there is no chord.
  std::array<double, kMaxSegments> torsion_rad{};
  /// The length by the chord, l = |t| / c1(theta^2 / 4), m; its variance, first order in the noise
  /// of both bodies, (sigma_t / c1)^2 + (l kappa)^2 var theta with l kappa = dl/dtheta; and its
  /// covariance with theta. |t| does not feel the bodies' orientation. 0 and infinite where the
  /// positions say nothing: inertial sensors, theta = 2 pi.
  std::array<double, kMaxSegments> length_m{};
  std::array<double, kMaxSegments> length_variance_m2{};
  std::array<double, kMaxSegments> length_covariance_m_rad{};
  /// |t| minus the PCC chord L c1(theta^2 / 4); zero for a PCC segment whose length is right.
  std::array<double, kMaxSegments> length_error_m{};
  /// False: one of the segment's bodies was not seen, or its pose fits no bend; the segment's
  /// numbers are then zero.
  std::array<bool, kMaxSegments> valid{};

  /// Makes segment `index` (0-based) one that was not observed.
  void leave_out(int index) noexcept;
};

/// u of one segment from the pose of its upper and lower end.
struct SegmentCurvature {
  Eigen::Vector2d u_rad = Eigen::Vector2d::Zero();
  double variance_rad2 = 0.0;
  double twist_rad = 0.0;
  double torsion_rad = 0.0;
  double chord_m = 0.0;            ///< |t|
  double chord_over_length = 0.0;  ///< c1(theta^2 / 4)
  double length_m = 0.0;
  double length_variance_m2 = std::numeric_limits<double>::infinity();
  double length_covariance_m_rad = 0.0;
  bool valid = false;
};

/// The estimator. Constant after construction; `estimate` may be called from anywhere. Segments may
/// stretch: u does not depend on the length, and e is `length_m` minus the length at rest, which the
/// residual `length_error_m` is relative to.
///
/// With (R, t) the relative transform (19) and q the quaternion of R, a PCC segment has
/// t/|t| = (q_y, -q_x, q_w) = (sin(theta/2) cos phi, sin(theta/2) sin phi, cos(theta/2)): position
/// and orientation each measure the same unit vector.
///  - pose: v = w_t t/|t| + w_R (q_y, -q_x, q_w), theta = 2 atan2(hypot(v1, v2), v3). An error
///  eps_a of the upper
///    frame's orientation turns t/|t| by eps_a and the other by eps_a / 2; so, with sigma_t^2 =
///    sigma_p,a^2 + sigma_p,b^2, the best linear weights are w_t ~ (sigma_b^2 - sigma_a^2) / 4 and
///    w_R ~ sigma_t^2 / |t|^2 + sigma_a^2 / 2, the same along and across the bending plane and at
///    any theta. Valid on [0, 2 pi), any phi.
///  - orientation: the second vector alone; t only settles its sign beyond theta = pi. Where
///  positions are all zero
///    (inertial sensors) theta is in [0, pi].
///  - printed: (20) literally, arctan(t2/t1) and sign(t3) arcsin: right for phi in (-pi/2, pi/2)
///  and theta in
///    [0, pi/2) only, noisy as 1/cos theta there. For comparison.
class CurvatureEstimator {
 public:
  /// `noise` holds n + 1 bodies, the base first.
  /// @throws std::invalid_argument where it does not, where a number is negative or not finite, or
  /// n is out of range.
  CurvatureEstimator(const EstimationSettings& settings, const ArmParameters& arm,
                     std::span<const BodyNoise> noise);

  /// Every segment of the frame; a frame of another number of segments is not observed at all.
  void estimate(const MocapFrame& frame, CurvatureEstimate& out) const noexcept;

  /// Segment `index` (0-based) between the poses of its two ends, whose `valid` is not looked at.
  SegmentCurvature segment(int index, const BodyPose& upper, const BodyPose& lower) const noexcept;

  int segments() const noexcept { return static_cast<int>(segments_.size()); }

 private:
  struct SegmentConstants {
    double length_m;
    double position_variance;  // sigma_t^2
    double upper_variance;     // sigma_a^2
    double lower_variance;     // sigma_b^2
  };

  CurvatureMethod method_;
  std::vector<SegmentConstants> segments_;
};

}  // namespace softarm
