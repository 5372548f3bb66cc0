// Our mocap message <-> the frame the core works on.
#pragma once

#include <softarm_messages/mocap_frame_t.hpp>
#include <vector>

#include "softarm/daemon/settings.hpp"
#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// Picks the base and the segment ends out of whatever bodies a frame carries. A body that is
/// absent counts as not seen.
class MocapAdapter {
 public:
  /// A base id below zero takes the base from `arm` as fixed and always seen.
  MocapAdapter(const BodySettings& bodies, const ArmParameters& arm);

  /// Everything but `capture_ns`, which only a clock relation can tell. Allocates nothing.
  void to_frame(const softarm_messages::mocap_frame_t& message, MocapFrame& frame) const noexcept;

  /// The message that `to_frame` turns back into this frame. Allocates only when the message grows.
  void to_message(const MocapFrame& frame, std::int64_t sender_time_us,
                  softarm_messages::mocap_frame_t& message) const;

 private:
  BodySettings bodies_;
  BodyPose fixed_base_;
};

}  // namespace softarm
