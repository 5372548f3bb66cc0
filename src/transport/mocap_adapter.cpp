#include "softarm/transport/mocap_adapter.hpp"

namespace softarm {
namespace {

void find_body(const softarm_messages::mocap_frame_t& message, int id, BodyPose& pose) noexcept {
  pose.valid = false;
  for (const auto& body : message.bodies) {
    if (body.id != id) continue;
    pose.valid = body.valid != 0;
    pose.position_m = {body.position_m[0], body.position_m[1], body.position_m[2]};
    pose.orientation = Eigen::Quaterniond(body.orientation[0], body.orientation[1],
                                          body.orientation[2], body.orientation[3]);
    return;
  }
}

softarm_messages::mocap_body_t to_body(int id, const BodyPose& pose) {
  softarm_messages::mocap_body_t body{};
  body.id = id;
  body.valid = pose.valid ? 1 : 0;
  for (int axis = 0; axis < 3; ++axis) body.position_m[axis] = pose.position_m[axis];
  body.orientation[0] = pose.orientation.w();
  body.orientation[1] = pose.orientation.x();
  body.orientation[2] = pose.orientation.y();
  body.orientation[3] = pose.orientation.z();
  return body;
}

}  // namespace

MocapAdapter::MocapAdapter(const BodySettings& bodies, const ArmParameters& arm)
    : bodies_(bodies),
      fixed_base_{.position_m = arm.base_position_m,
                  .orientation = Eigen::Quaterniond(arm.base_rotation),
                  .valid = true} {}

void MocapAdapter::to_frame(const softarm_messages::mocap_frame_t& message,
                            MocapFrame& frame) const noexcept {
  frame.frame_number = message.frame_number;
  frame.segments = static_cast<int>(bodies_.segment_ids.size());
  if (bodies_.base_id < 0) {
    frame.body[0] = fixed_base_;
  } else {
    find_body(message, bodies_.base_id, frame.body[0]);
  }
  for (std::size_t i = 0; i < bodies_.segment_ids.size(); ++i)
    find_body(message, bodies_.segment_ids[i], frame.body[i + 1]);
}

void MocapAdapter::to_message(const MocapFrame& frame, std::int64_t sender_time_us,
                              softarm_messages::mocap_frame_t& message) const {
  message.frame_number = frame.frame_number;
  message.capture_time_us = sender_time_us;
  message.bodies.clear();
  if (bodies_.base_id >= 0) message.bodies.push_back(to_body(bodies_.base_id, frame.body[0]));
  for (std::size_t i = 0; i < bodies_.segment_ids.size(); ++i)
    message.bodies.push_back(to_body(bodies_.segment_ids[i], frame.body[i + 1]));
  message.num_bodies = static_cast<std::int16_t>(message.bodies.size());
}

}  // namespace softarm
