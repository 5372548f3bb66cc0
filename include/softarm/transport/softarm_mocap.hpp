// softarm's own motion-capture message.
#pragma once

#include <softarm_messages/mocap_frame_t.hpp>

#include "softarm/transport/mocap_format.hpp"

namespace softarm {

/// Bodies beyond SentFrame::kMostBodies are left out.
void to_sent(const softarm_messages::mocap_frame_t& message, SentFrame& frame) noexcept;

/// The message that carries this frame. Allocates only where it grows.
void to_message(const SentFrame& frame, softarm_messages::mocap_frame_t& message);

}  // namespace softarm
