// Motion-capture messages <-> the frame the core works on.
#pragma once

#include <cstdint>
#include <softarm_messages/mocap_frame_t.hpp>
#include <softarm_messages/optitrack_frame_t.hpp>
#include <softarm_messages/rigid_transform_t.hpp>
#include <vector>

#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/transport/optitrack_frame.hpp"
#include "softarm/transport/pose_convention.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {

/// Picks the base and the segment ends out of whatever bodies a frame carries, and brings them to
/// our world by their PoseConvention (mocap.unit, mocap.axes, and the poses of S_i on the bodies).
/// A body that is absent counts as not seen. What is left at its default changes no bit.
class MocapAdapter {
 public:
  /// A base id below zero takes the base from `arm` as fixed and always seen.
  MocapAdapter(const BodySettings& bodies, const ArmParameters& arm,
               const MocapSourceSettings& mocap = {});

  /// Everything but `capture_ns`, which only a clock relation can tell. Allocates nothing.
  void to_frame(const softarm_messages::mocap_frame_t& message, MocapFrame& frame) const noexcept;
  void to_frame(const OptitrackFrame& message, MocapFrame& frame) const noexcept;

  /// Body 0 is the base, body i the end of segment i.
  BodyPose to_pose(const softarm_messages::rigid_transform_t& message,
                   std::size_t body) const noexcept;

  /// A frame in which nothing is seen but a fixed base.
  void clear(MocapFrame& frame) const noexcept;

  /// The message that `to_frame` turns back into this frame (optitrack_frame_t: rounded to floats).
  /// Allocates only when the message grows.
  void to_message(const MocapFrame& frame, std::int64_t sender_time_us,
                  softarm_messages::mocap_frame_t& message) const;
  void to_message(const MocapFrame& frame, std::int64_t sender_time_us,
                  softarm_messages::optitrack_frame_t& message) const;
  /// One body, which is seen.
  void to_message(const BodyPose& pose, std::size_t body, std::int64_t sender_time_us,
                  softarm_messages::rigid_transform_t& message) const noexcept;

  bool base_is_fixed() const noexcept { return bodies_.base_id < 0; }

 private:
  template <class Number>
  BodyPose read(const Number* position, const Number* orientation, bool valid,
                std::size_t body) const noexcept;
  template <class Number>
  void write(const BodyPose& pose, std::size_t body, Number* position,
             Number* orientation) const noexcept;
  template <class Bodies, class Pose>
  void pick(const Bodies& bodies, const Pose& pose, MocapFrame& frame) const noexcept;
  int id(std::size_t body) const noexcept {
    return body == 0 ? bodies_.base_id : bodies_.segment_ids[body - 1];
  }

  BodySettings bodies_;
  BodyPose fixed_base_;
  bool xyzw_;
  std::vector<PoseConvention> convention_;  // of the base, then of the segments' ends
};

}  // namespace softarm
