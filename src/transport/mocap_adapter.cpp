#include "softarm/transport/mocap_adapter.hpp"

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

template <class Number>
BodyPose MocapAdapter::seen(const Number* position, const Number* orientation,
                            std::size_t body) const noexcept {
  BodyPose pose;
  pose.valid = true;
  for (int axis = 0; axis < 3; ++axis) pose.position_m[axis] = double{position[axis]};
  const Number* vector = xyzw_ ? orientation : orientation + 1;
  const Number scalar = xyzw_ ? orientation[3] : orientation[0];
  pose.orientation = Eigen::Quaterniond(scalar, vector[0], vector[1], vector[2]);
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

MocapAdapter::Sent MocapAdapter::sent(const BodyPose& pose, std::size_t body) const noexcept {
  Sent out{pose.position_m, pose.orientation};
  const Plate& plate = plate_[body];
  if (plate.given) {
    out.orientation = out.orientation * plate.orientation.conjugate();
    out.position -= out.orientation * plate.position_m;
  }
  if (turned_) {
    out.position = (axes_matrix_.transpose() * out.position).eval();
    out.orientation = axes_.conjugate() * out.orientation;
  }
  if (unit_m_ != 1.0) out.position /= unit_m_;
  return out;
}

template <class Number>
void MocapAdapter::write(const Sent& sent, Number* position, Number* orientation) const noexcept {
  for (int axis = 0; axis < 3; ++axis) position[axis] = static_cast<Number>(sent.position[axis]);
  Number* vector = xyzw_ ? orientation : orientation + 1;
  orientation[xyzw_ ? 3 : 0] = static_cast<Number>(sent.orientation.w());
  vector[0] = static_cast<Number>(sent.orientation.x());
  vector[1] = static_cast<Number>(sent.orientation.y());
  vector[2] = static_cast<Number>(sent.orientation.z());
}

void MocapAdapter::clear(MocapFrame& frame) const noexcept {
  frame.segments = static_cast<int>(bodies_.segment_ids.size());
  for (std::size_t i = 0; i < plate_.size(); ++i) frame.body[i].valid = false;
  if (base_is_fixed()) frame.body[0] = fixed_base_;
}

template <class Bodies, class Read>
void MocapAdapter::pick(const Bodies& bodies, const Read& read, MocapFrame& frame) const noexcept {
  clear(frame);
  for (std::size_t i = base_is_fixed() ? 1 : 0; i < plate_.size(); ++i) {
    for (const auto& body : bodies) {
      if (body.id != id(i)) continue;
      frame.body[i] = read(body, i);
      break;
    }
  }
}

void MocapAdapter::to_frame(const softarm_messages::mocap_frame_t& message,
                            MocapFrame& frame) const noexcept {
  frame.frame_number = message.frame_number;
  const auto read = [this](const softarm_messages::mocap_body_t& body, std::size_t i) {
    BodyPose pose = seen(body.position_m, body.orientation, i);
    pose.valid = body.valid != 0;
    return pose;
  };
  pick(message.bodies, read, frame);
}

void MocapAdapter::to_frame(const OptitrackFrame& message, MocapFrame& frame) const noexcept {
  frame.frame_number = message.frame_number;
  const auto read = [this](const OptitrackBody& body, std::size_t i) {
    BodyPose pose = seen(body.position.data(), body.orientation.data(), i);
    pose.valid = body.tracked;
    return pose;
  };
  pick(std::span(message.body).first(message.bodies), read, frame);
}

BodyPose MocapAdapter::to_pose(const softarm_messages::rigid_transform_t& message,
                               std::size_t body) const noexcept {
  return seen(message.trans, message.quat, body);
}

void MocapAdapter::to_message(const MocapFrame& frame, std::int64_t sender_time_us,
                              softarm_messages::mocap_frame_t& message) const {
  message.frame_number = frame.frame_number;
  message.capture_time_us = sender_time_us;
  message.bodies.clear();
  for (std::size_t i = base_is_fixed() ? 1 : 0; i < plate_.size(); ++i) {
    auto& body = message.bodies.emplace_back();
    body.id = id(i);
    body.valid = frame.body[i].valid ? 1 : 0;
    write(sent(frame.body[i], i), body.position_m, body.orientation);
  }
  message.num_bodies = static_cast<std::int16_t>(message.bodies.size());
}

void MocapAdapter::to_message(const MocapFrame& frame, std::int64_t sender_time_us,
                              softarm_messages::optitrack_frame_t& message) const {
  message = {};
  message.utime = sender_time_us;
  message.frame = static_cast<std::int32_t>(frame.frame_number);
  message.timestamp = 1e-6 * static_cast<double>(sender_time_us);
  for (std::size_t i = base_is_fixed() ? 1 : 0; i < plate_.size(); ++i) {
    auto& body = message.rigid_bodies.emplace_back();
    body.id = id(i);
    body.params = frame.body[i].valid ? 1 : 0;
    write(sent(frame.body[i], i), body.xyz, body.quat);
  }
  message.num_rigid_bodies = static_cast<std::int32_t>(message.rigid_bodies.size());
}

void MocapAdapter::to_message(const BodyPose& pose, std::size_t body, std::int64_t sender_time_us,
                              softarm_messages::rigid_transform_t& message) const noexcept {
  message.utime = sender_time_us;
  write(sent(pose, body), message.trans, message.quat);
}

}  // namespace softarm
