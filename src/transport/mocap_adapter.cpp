#include "softarm/transport/mocap_adapter.hpp"

#include <algorithm>
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
    MarkerFrameSettings frame;
    if (i == 0 && !base_is_fixed()) frame = bodies.base_marker_frame;
    if (i > 0 && i <= bodies.segment_marker_frames.size())
      frame = bodies.segment_marker_frames[i - 1];
    convention_[i] = {unit_m, mocap.axes, pose_on_body(frame)};
  }
}

BodyPose MocapAdapter::to_pose(const SentBody& sent, std::size_t body) const noexcept {
  BodyPose pose;
  pose.valid = sent.seen;
  pose.position_m = Eigen::Vector3d::Map(sent.position.data());
  const double* vector = sent.orientation.data() + (xyzw_ ? 0 : 1);
  pose.orientation =
      Eigen::Quaterniond(sent.orientation[xyzw_ ? 3 : 0], vector[0], vector[1], vector[2]);
  return convention_[body].to_world(pose);
}

SentBody MocapAdapter::to_sent(const BodyPose& pose, std::size_t body) const noexcept {
  const BodyPose out = convention_[body].to_sent(pose);
  SentBody sent{.id = id(body), .seen = pose.valid};
  Eigen::Vector3d::Map(sent.position.data()) = out.position_m;
  Eigen::Vector3d::Map(sent.orientation.data() + (xyzw_ ? 0 : 1)) = out.orientation.vec();
  sent.orientation[xyzw_ ? 3 : 0] = out.orientation.w();
  return sent;
}

void MocapAdapter::clear(MocapFrame& frame) const noexcept {
  frame.segments = static_cast<int>(bodies_.segment_ids.size());
  for (std::size_t i = 0; i < convention_.size(); ++i) frame.body[i].valid = false;
  if (base_is_fixed()) frame.body[0] = fixed_base_;
}

void MocapAdapter::to_frame(const SentFrame& sent, MocapFrame& frame) const noexcept {
  clear(frame);
  frame.frame_number = sent.frame_number;
  const auto bodies = std::span(sent.body).first(std::min(sent.bodies, sent.body.size()));
  for (std::size_t i = base_is_fixed() ? 1 : 0; i < convention_.size(); ++i) {
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
  for (std::size_t i = base_is_fixed() ? 1 : 0; i < convention_.size(); ++i)
    sent.body[sent.bodies++] = to_sent(frame.body[i], i);
}

}  // namespace softarm
