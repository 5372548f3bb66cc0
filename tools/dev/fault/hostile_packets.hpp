// Malformed packets without end, no two alike: what random malice may send to a daemon.
#pragma once

#include <random>

#include "dev/fault/raw_packets.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {

/// The same packets for the same seed. Each is refused, by LCM, by decode() or by the receiver:
/// cut off, with bytes behind it, of another type, with a wrong count, of random bytes, with a
/// broken LCM header or channel name, or with NaN. Left out are fragments, because of
/// what they do to LCM 1.3.1, and well-formed frames with wrong numbers: those are frame faults
/// (fault_injector.hpp).
class HostilePackets {
 public:
  HostilePackets(const LcmSettings& lcm, int segments, int chambers, unsigned seed);

  Packet next();

 private:
  std::size_t below(std::size_t end);
  Packet noise(std::size_t most);
  Packet corrupted(SampleMessage sample);
  Packet broken_header();

  std::vector<SampleMessage> samples_;
  std::mt19937 random_;
};

}  // namespace softarm
