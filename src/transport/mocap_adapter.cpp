#include "softarm/transport/mocap_adapter.hpp"

#include <span>

#include "softarm/transport/settings.hpp"

namespace softarm {

MocapAdapter::MocapAdapter(const BodySettings& bodies, const ArmParameters& arm,
                           const MocapSourceSettings& mocap)
    : bodies_(bodies),
      fixed_base_{.position_m = arm.base_position_m,
                  .orientation = Eigen::Quaterniond(arm.base_rotation),
                  .valid = true},
      xyzw_(mocap.quaternion == QuaternionOrder::xyzw),
      convention_(bodies.segment_ids.size() + 1) {
  const double unit_m = mocap.unit == LengthUnit::millimetre ? 1e-3 : 1.0;
  for (std::size_t i = 0; i < convention_.size(); ++i) {
    PlateSettings plate;
    if (i == 0 && !base_is_fixed()) plate = bodies.base_plate;
    if (i > 0 && i <= bodies.segment_plates.size()) plate = bodies.segment_plates[i - 1];
    convention_[i] = {unit_m, mocap.axes, pose_on_body(plate)};
  }
}

template <class Number>
BodyPose MocapAdapter::read(const Number* position, const Number* orientation, bool valid,
                            std::size_t body) const noexcept {
  BodyPose pose;
  pose.valid = valid;
  for (int axis = 0; axis < 3; ++axis) pose.position_m[axis] = double{position[axis]};
  const Number* vector = xyzw_ ? orientation : orientation + 1;
  const Number scalar = xyzw_ ? orientation[3] : orientation[0];
  pose.orientation = Eigen::Quaterniond(scalar, vector[0], vector[1], vector[2]);
  return convention_[body].to_world(pose);
}

template <class Number>
void MocapAdapter::write(const BodyPose& pose, std::size_t body, Number* position,
                         Number* orientation) const noexcept {
  const BodyPose sent = convention_[body].to_sent(pose);
  for (int axis = 0; axis < 3; ++axis) position[axis] = static_cast<Number>(sent.position_m[axis]);
  Number* vector = xyzw_ ? orientation : orientation + 1;
  orientation[xyzw_ ? 3 : 0] = static_cast<Number>(sent.orientation.w());
  vector[0] = static_cast<Number>(sent.orientation.x());
  vector[1] = static_cast<Number>(sent.orientation.y());
  vector[2] = static_cast<Number>(sent.orientation.z());
}

void MocapAdapter::clear(MocapFrame& frame) const noexcept {
  frame.segments = static_cast<int>(bodies_.segment_ids.size());
  for (std::size_t i = 0; i < convention_.size(); ++i) frame.body[i].valid = false;
  if (base_is_fixed()) frame.body[0] = fixed_base_;
}

template <class Bodies, class Pose>
void MocapAdapter::pick(const Bodies& bodies, const Pose& pose, MocapFrame& frame) const noexcept {
  clear(frame);
  for (std::size_t i = base_is_fixed() ? 1 : 0; i < convention_.size(); ++i) {
    for (const auto& body : bodies) {
      if (body.id != id(i)) continue;
      frame.body[i] = pose(body, i);
      break;
    }
  }
}

void MocapAdapter::to_frame(const softarm_messages::mocap_frame_t& message,
                            MocapFrame& frame) const noexcept {
  frame.frame_number = message.frame_number;
  const auto pose = [this](const softarm_messages::mocap_body_t& body, std::size_t i) {
    return read(body.position_m, body.orientation, body.valid != 0, i);
  };
  pick(message.bodies, pose, frame);
}

void MocapAdapter::to_frame(const OptitrackFrame& message, MocapFrame& frame) const noexcept {
  frame.frame_number = message.frame_number;
  const auto pose = [this](const OptitrackBody& body, std::size_t i) {
    return read(body.position.data(), body.orientation.data(), body.tracked, i);
  };
  pick(std::span(message.body).first(message.bodies), pose, frame);
}

BodyPose MocapAdapter::to_pose(const softarm_messages::rigid_transform_t& message,
                               std::size_t body) const noexcept {
  return read(message.trans, message.quat, true, body);
}

void MocapAdapter::to_message(const MocapFrame& frame, std::int64_t sender_time_us,
                              softarm_messages::mocap_frame_t& message) const {
  message.frame_number = frame.frame_number;
  message.capture_time_us = sender_time_us;
  message.bodies.clear();
  for (std::size_t i = base_is_fixed() ? 1 : 0; i < convention_.size(); ++i) {
    auto& body = message.bodies.emplace_back();
    body.id = id(i);
    body.valid = frame.body[i].valid ? 1 : 0;
    write(frame.body[i], i, body.position_m, body.orientation);
  }
  message.num_bodies = static_cast<std::int16_t>(message.bodies.size());
}

void MocapAdapter::to_message(const MocapFrame& frame, std::int64_t sender_time_us,
                              softarm_messages::optitrack_frame_t& message) const {
  message = {};
  message.utime = sender_time_us;
  message.frame = static_cast<std::int32_t>(frame.frame_number);
  message.timestamp = 1e-6 * static_cast<double>(sender_time_us);
  for (std::size_t i = base_is_fixed() ? 1 : 0; i < convention_.size(); ++i) {
    auto& body = message.rigid_bodies.emplace_back();
    body.id = id(i);
    body.params = frame.body[i].valid ? 1 : 0;
    write(frame.body[i], i, body.xyz, body.quat);
  }
  message.num_rigid_bodies = static_cast<std::int32_t>(message.rigid_bodies.size());
}

void MocapAdapter::to_message(const BodyPose& pose, std::size_t body, std::int64_t sender_time_us,
                              softarm_messages::rigid_transform_t& message) const noexcept {
  message.utime = sender_time_us;
  write(pose, body, message.trans, message.quat);
}

}  // namespace softarm
