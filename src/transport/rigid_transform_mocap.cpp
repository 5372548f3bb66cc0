// One body a message, rigid_transform_t: Vicon's bridges.
#include <algorithm>
#include <softarm_messages/rigid_transform_t.hpp>

#include "softarm/transport/message_decoding.hpp"
#include "transport/lcm_mocap_format.hpp"

namespace softarm {
namespace {

class RigidTransformFormat final : public LcmMocapFormat<softarm_messages::rigid_transform_t> {
 public:
  bool decode(std::span<const std::byte> bytes, SentFrame& frame) noexcept override {
    if (!softarm::decode(bytes, message_)) return false;
    frame.sender_time_us = message_.utime;
    frame.bodies = 1;
    frame.body[0] = {.id = 0,
                     .seen = true,
                     .position = std::to_array(message_.trans),
                     .orientation = std::to_array(message_.quat)};
    return true;
  }

  std::span<const std::byte> encode(const SentFrame& frame) override {
    message_.utime = frame.sender_time_us;
    std::copy_n(frame.body[0].position.begin(), 3, message_.trans);
    std::copy_n(frame.body[0].orientation.begin(), 4, message_.quat);
    return encoded();
  }
};

}  // namespace

MocapSourceKind rigid_transform_mocap() {
  return {.label = "rigid_transform",
          .make = made<MocapFormat, RigidTransformFormat>,
          .channel = "VICON",
          .channel_per_body = true};
}

}  // namespace softarm
