#include "softarm/transport/pose_convention.hpp"

namespace softarm {

BodyPose pose_on_body(const MarkerFrameSettings& settings) {
  BodyPose pose{.position_m = settings.position_m, .valid = true};
  const double angle_rad = settings.rotation_rad.norm();
  if (angle_rad != 0.0)
    pose.orientation = Eigen::AngleAxisd(angle_rad, settings.rotation_rad / angle_rad);
  return pose;
}

MarkerFrameSettings with_pose_on_body(MarkerFrameSettings settings, const Eigen::Isometry3d& pose) {
  const Eigen::AngleAxisd rotation(pose.linear());
  settings.position_m = pose.translation();
  settings.rotation_rad = rotation.angle() * rotation.axis();
  return settings;
}

PoseConvention::PoseConvention(double unit_m, const Eigen::Matrix3d& axes, const BodyPose& on_body)
    : unit_m_(unit_m),
      turned_(axes != Eigen::Matrix3d::Identity()),
      offset_(!on_body.position_m.isZero(0.0) || !on_body.orientation.vec().isZero(0.0)),
      axes_(axes),
      axes_matrix_(axes),
      on_body_(on_body) {}

BodyPose PoseConvention::to_world(BodyPose pose) const noexcept {
  if (unit_m_ != 1.0) pose.position_m *= unit_m_;
  if (turned_) {
    pose.position_m = (axes_matrix_ * pose.position_m).eval();
    pose.orientation = axes_ * pose.orientation;
  }
  if (offset_) {
    // A quaternion that is off one is the validator's business; it must not stretch the offset.
    pose.position_m += pose.orientation.normalized() * on_body_.position_m;
    pose.orientation = pose.orientation * on_body_.orientation;
  }
  return pose;
}

BodyPose PoseConvention::to_sent(BodyPose pose) const noexcept {
  if (offset_) {
    pose.orientation = pose.orientation * on_body_.orientation.conjugate();
    pose.position_m -= pose.orientation * on_body_.position_m;
  }
  if (turned_) {
    pose.position_m = (axes_matrix_.transpose() * pose.position_m).eval();
    pose.orientation = axes_.conjugate() * pose.orientation;
  }
  if (unit_m_ != 1.0) pose.position_m /= unit_m_;
  return pose;
}

}  // namespace softarm
