// What a source sent, compared with what is read back.
#pragma once

#include <cstring>

#include "softarm/transport/mocap_format.hpp"

namespace softarm::test {

/// Bit for bit: NaN is itself.
inline bool same_body(const SentBody& a, const SentBody& b) {
  return a.id == b.id && a.seen == b.seen &&
         std::memcmp(a.position.data(), b.position.data(), sizeof a.position) == 0 &&
         std::memcmp(a.orientation.data(), b.orientation.data(), sizeof a.orientation) == 0;
}

}  // namespace softarm::test
