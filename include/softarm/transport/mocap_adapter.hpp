// Motion capture as sent <-> the frame that the core works on.
#pragma once

#include <cstdint>
#include <vector>

#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/transport/mocap_format.hpp"
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

  /// Everything but `capture_ns`, which only a clock relation can find. Allocates nothing.
  void to_frame(const SentFrame& sent, MocapFrame& frame) const noexcept;
  /// Body 0 is the base, body i the end of segment i.
  BodyPose to_pose(const SentBody& sent, std::size_t body) const noexcept;

  /// A frame in which nothing is seen but a fixed base.
  void clear(MocapFrame& frame) const noexcept;

  /// The other way round; a fixed base is not sent.
  void to_sent(const MocapFrame& frame, std::int64_t sender_time_us,
               SentFrame& sent) const noexcept;
  SentBody to_sent(const BodyPose& pose, std::size_t body) const noexcept;

  bool base_is_fixed() const noexcept { return bodies_.base_id < 0; }

 private:
  int id(std::size_t body) const noexcept {
    return body == 0 ? bodies_.base_id : bodies_.segment_ids[body - 1];
  }

  BodySettings bodies_;
  BodyPose fixed_base_;
  bool xyzw_;
  std::vector<PoseConvention> convention_;  // of the base, then of the segments' ends
};

}  // namespace softarm
