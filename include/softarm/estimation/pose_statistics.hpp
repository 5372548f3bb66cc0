// What many measurements of one body that keeps still tell: where it is, how well that is known,
// and whether it did keep still.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "softarm/model/arm.hpp"

namespace softarm {

/// The mean of poses, added one by one.
class MeanPose {
 public:
  /// q and -q mean the same; a quaternion of zeros counts for the position alone.
  void add(const Eigen::Vector3d& position_m, const Eigen::Quaterniond& orientation) noexcept;

  int count() const noexcept { return count_; }
  /// All of the following: at least one pose.
  Eigen::Vector3d position_m() const noexcept { return position_sum_ / count_; }
  /// The rotation nearest to all in the mean square of their matrices' difference: the eigenvector
  /// of the largest eigenvalue of sum q q', whatever the signs of q. Unit length.
  Eigen::Quaterniond orientation() const noexcept;
  /// Mean length of the quaternions as they were added: 1 from a sender that does what it should.
  double quaternion_length() const noexcept { return length_sum_ / count_; }
  Eigen::Isometry3d pose() const noexcept;

 private:
  int count_ = 0;
  Eigen::Vector3d position_sum_ = Eigen::Vector3d::Zero();
  Eigen::Matrix4d products_ = Eigen::Matrix4d::Zero();
  double length_sum_ = 0.0;
};

/// B_i^-1 S_i: where the frames S_0 .. S_n of an arm that rests in u (2n, rad), with S_0 as
/// arm.base_* has it, sit on the bodies that carry them.
/// @param mean  n + 1 mean poses B_i
std::vector<Eigen::Isometry3d> frames_on_bodies(const ArmParameters& arm, ConstVectorRef u_rad,
                                                std::span<const Eigen::Isometry3d> mean);

/// A pose of one body and its time.
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

/// Of poses in order of time, at least two.
PoseStatistics pose_statistics(std::span<const TimedPose> poses);

}  // namespace softarm
