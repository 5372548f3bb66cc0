// From the convention in which a source sends the pose of a body to ours: SI units, world frame.
#pragma once

#include <Eigen/Geometry>

#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {

/// Pose of S_i in the frame of the body that carries it; always `valid`.
BodyPose pose_on_body(const MarkerFrameSettings& settings);
/// The same settings with another pose on the body.
MarkerFrameSettings with_pose_on_body(MarkerFrameSettings settings, const Eigen::Isometry3d& pose);

inline Eigen::Isometry3d to_isometry(const BodyPose& pose) {
  return Eigen::Translation3d(pose.position_m) * pose.orientation;
}

/// From the position p and orientation R of a body as they are sent to the frame S_i that it
/// carries, in our world:
///   R_world = A R E,  p_world = s A p + A R t,
/// with the unit s, the rotation A from the sender's axes to ours, and the pose t, E of S_i on the
/// body. What is left at its default changes no bit.
class PoseConvention {
 public:
  /// Metres in our own world, of S_i itself.
  PoseConvention() = default;
  PoseConvention(double unit_m, const Eigen::Matrix3d& axes, const BodyPose& on_body);

  /// As sent to as we know it; `valid` is kept.
  BodyPose to_world(BodyPose sent) const noexcept;
  /// Its inverse.
  BodyPose to_sent(BodyPose world) const noexcept;

 private:
  double unit_m_ = 1.0;
  bool turned_ = false, offset_ = false;
  Eigen::Quaterniond axes_ = Eigen::Quaterniond::Identity();
  Eigen::Matrix3d axes_matrix_ = Eigen::Matrix3d::Identity();
  BodyPose on_body_;
};

}  // namespace softarm
