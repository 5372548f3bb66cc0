#include "softarm/transport/mocap_adapter.hpp"

#include <algorithm>
#include <span>

#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

/// exp(rotation^) as a quaternion.
Eigen::Quaterniond turn(const Eigen::Vector3d& rotation_rad) {
  const double angle_rad = rotation_rad.norm();
  if (angle_rad == 0.0) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, rotation_rad / angle_rad));
}

}  // namespace

MocapAdapter::MocapAdapter(const BodySettings& bodies, const ArmParameters& arm,
                           const MocapSourceSettings& mocap)
    : bodies_(bodies),
      fixed_base_{.position_m = arm.base_position_m,
                  .orientation = Eigen::Quaterniond(arm.base_rotation),
                  .valid = true},
      xyzw_(mocap.quaternion == QuaternionOrder::xyzw),
      unit_m_(mocap.unit == LengthUnit::millimetre ? 1e-3 : 1.0),
      turned_(mocap.axes != Eigen::Matrix3d::Identity()),
      axes_(mocap.axes),
      axes_matrix_(mocap.axes),
      plate_(bodies.segment_ids.size() + 1) {
  const auto set = [](Plate& plate, const PlateSettings& settings) {
    plate.given = !settings.position_m.isZero(0.0) || !settings.rotation_rad.isZero(0.0);
    plate.position_m = settings.position_m;
    plate.orientation = turn(settings.rotation_rad);
  };
  if (bodies.base_id >= 0) set(plate_[0], bodies.base_plate);
  for (std::size_t i = 0; i < bodies.segment_plates.size() && i + 1 < plate_.size(); ++i)
    set(plate_[i + 1], bodies.segment_plates[i]);
}

BodyPose MocapAdapter::to_pose(const SentBody& sent, std::size_t body) const noexcept {
  BodyPose pose;
  pose.valid = sent.seen;
  pose.position_m = Eigen::Vector3d::Map(sent.position.data());
  const double* vector = sent.orientation.data() + (xyzw_ ? 0 : 1);
  pose.orientation =
      Eigen::Quaterniond(sent.orientation[xyzw_ ? 3 : 0], vector[0], vector[1], vector[2]);
  if (unit_m_ != 1.0) pose.position_m *= unit_m_;
  if (turned_) {
    pose.position_m = (axes_matrix_ * pose.position_m).eval();
    pose.orientation = axes_ * pose.orientation;
  }
  const Plate& plate = plate_[body];
  if (!plate.given) return pose;
  // A quaternion that is off one is the validator's business; it must not stretch the offset.
  pose.position_m += pose.orientation.normalized() * plate.position_m;
  pose.orientation = pose.orientation * plate.orientation;
  return pose;
}

SentBody MocapAdapter::to_sent(const BodyPose& pose, std::size_t body) const noexcept {
  Eigen::Vector3d position = pose.position_m;
  Eigen::Quaterniond orientation = pose.orientation;
  const Plate& plate = plate_[body];
  if (plate.given) {
    orientation = orientation * plate.orientation.conjugate();
    position -= orientation * plate.position_m;
  }
  if (turned_) {
    position = (axes_matrix_.transpose() * position).eval();
    orientation = axes_.conjugate() * orientation;
  }
  if (unit_m_ != 1.0) position /= unit_m_;
  SentBody sent{.id = id(body), .seen = pose.valid};
  Eigen::Vector3d::Map(sent.position.data()) = position;
  Eigen::Vector3d::Map(sent.orientation.data() + (xyzw_ ? 0 : 1)) = orientation.vec();
  sent.orientation[xyzw_ ? 3 : 0] = orientation.w();
  return sent;
}

void MocapAdapter::clear(MocapFrame& frame) const noexcept {
  frame.segments = static_cast<int>(bodies_.segment_ids.size());
  for (std::size_t i = 0; i < plate_.size(); ++i) frame.body[i].valid = false;
  if (base_is_fixed()) frame.body[0] = fixed_base_;
}

void MocapAdapter::to_frame(const SentFrame& sent, MocapFrame& frame) const noexcept {
  clear(frame);
  frame.frame_number = sent.frame_number;
  const auto bodies = std::span(sent.body).first(std::min(sent.bodies, sent.body.size()));
  for (std::size_t i = base_is_fixed() ? 1 : 0; i < plate_.size(); ++i) {
    const auto found = std::find_if(bodies.begin(), bodies.end(),
                                    [&](const SentBody& body) { return body.id == id(i); });
    if (found != bodies.end()) frame.body[i] = to_pose(*found, i);
  }
}

void MocapAdapter::to_sent(const MocapFrame& frame, std::int64_t sender_time_us,
                           SentFrame& sent) const noexcept {
  sent.frame_number = frame.frame_number;
  sent.sender_time_us = sender_time_us;
  sent.bodies = 0;
  for (std::size_t i = base_is_fixed() ? 1 : 0; i < plate_.size(); ++i)
    sent.body[sent.bodies++] = to_sent(frame.body[i], i);
}

}  // namespace softarm
