// Formats whose messages LCM encodes.
#pragma once

#include <vector>

#include "softarm/transport/mocap_format.hpp"

namespace softarm {

/// `encode` of a format for messages of this LCM type: a format fills `message_` and returns
/// `encoded()`.
template <class Message>
class LcmMocapFormat : public MocapFormat {
 protected:
  std::span<const std::byte> encoded() {
    bytes_.resize(static_cast<std::size_t>(message_.getEncodedSize()));
    message_.encode(bytes_.data(), 0, static_cast<int>(bytes_.size()));
    return bytes_;
  }

  Message message_{};

 private:
  std::vector<std::byte> bytes_;
};

}  // namespace softarm
