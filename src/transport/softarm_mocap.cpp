// softarm's own frames, mocap_frame_t.
#include "softarm/transport/softarm_mocap.hpp"

#include <algorithm>

#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "transport/lcm_mocap_format.hpp"

namespace softarm {
namespace {

using softarm_messages::mocap_frame_t;

class SoftarmFormat final : public LcmMocapFormat<mocap_frame_t> {
 public:
  SoftarmFormat() { message_.bodies.reserve(4 * static_cast<std::size_t>(kMaxBodies)); }

  bool decode(std::span<const std::byte> bytes, SentFrame& frame) noexcept override {
    if (!softarm::decode(bytes, message_)) return false;
    to_sent(message_, frame);
    return true;
  }

  std::span<const std::byte> encode(const SentFrame& frame) override {
    to_message(frame, message_);
    return encoded();
  }
};

}  // namespace

void to_sent(const mocap_frame_t& message, SentFrame& frame) noexcept {
  frame.frame_number = message.frame_number;
  frame.sender_time_us = message.capture_time_us;
  frame.bodies = std::min(message.bodies.size(), frame.body.size());
  for (std::size_t i = 0; i < frame.bodies; ++i) {
    const auto& body = message.bodies[i];
    frame.body[i] = {body.id, body.valid != 0, std::to_array(body.position_m),
                     std::to_array(body.orientation)};
  }
}

void to_message(const SentFrame& frame, mocap_frame_t& message) {
  message.frame_number = frame.frame_number;
  message.capture_time_us = frame.sender_time_us;
  message.num_bodies = static_cast<std::int16_t>(frame.bodies);
  message.bodies.resize(frame.bodies);
  for (std::size_t i = 0; i < frame.bodies; ++i) {
    auto& body = message.bodies[i];
    body.id = frame.body[i].id;
    body.valid = frame.body[i].seen ? 1 : 0;
    std::copy_n(frame.body[i].position.begin(), 3, body.position_m);
    std::copy_n(frame.body[i].orientation.begin(), 4, body.orientation);
  }
}

MocapSourceKind softarm_mocap() {
  return {.label = "softarm", .make = made<MocapFormat, SoftarmFormat>};
}

}  // namespace softarm
