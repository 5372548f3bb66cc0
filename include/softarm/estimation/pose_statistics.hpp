// What many looks at one body that keeps still tell: where it is, how well that is known, and
// whether it did keep still.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>

namespace softarm {

struct TimedPose {
  std::int64_t time_ns = 0;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< q and -q mean the same
};

/// Numbers an axis are root mean squares over the three axes; those of orientations are of the
/// rotation vector from the mean.
struct PoseStatistics {
  Eigen::Isometry3d mean = Eigen::Isometry3d::Identity();
  int frames = 0;
  double position_spread_m = 0.0;  ///< standard deviation an axis
  double orientation_spread_rad = 0.0;
  /// Standard error of the mean an axis, from the scatter of the means of 0.1 s each: noise that
  /// lasts longer than a frame counts as what it is.
  double position_error_m = 0.0;
  double orientation_error_rad = 0.0;
  /// Of the 0.1 s whose mean is farthest from the mean of all, measured by what noise allows it.
  double wander_m = 0.0;
  double wander_rad = 0.0;
  /// What noise from frame to frame explains: 6 standard deviations, at least 0.3 mm and 3 mrad.
  double wander_limit_m = 0.0;
  double wander_limit_rad = 0.0;

  bool still() const { return wander_m <= wander_limit_m && wander_rad <= wander_limit_rad; }
};

/// The rotation nearest to all in the mean square of their matrices' difference: the eigenvector of
/// the largest eigenvalue of sum q q', whatever the signs of q. At least one.
Eigen::Quaterniond mean_rotation(std::span<const TimedPose> poses);

/// Of poses in order of time, at least two.
PoseStatistics pose_statistics(std::span<const TimedPose> poses);

}  // namespace softarm
