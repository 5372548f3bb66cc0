// Keeps what comes of a running arm, for the pre-run checks.
#pragma once

#include <set>

#include "softarm/client/arm_client.hpp"
#include "softarm/commissioning/preflight/observation.hpp"
#include "softarm/transport/mocap_source.hpp"

namespace softarm {

/// Takes the client's callbacks for messages, frames, measured pressures and commands; the client
/// must not handle messages after the observer is gone.
class Observer {
 public:
  explicit Observer(ArmClient& client);
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  /// Nothing is commanded by us up to here.
  void rest_ends() { seen_.rest_end_ns = client_.now_ns(); }
  void add(const Pulse& pulse) { seen_.pulses.push_back(pulse); }
  const Observation& seen();

 private:
  void take_message(const ArmMessage& message);
  void take_frame(const CapturedFrame& captured);
  void note_ids(std::span<const std::byte> bytes);

  ArmClient& client_;
  MocapSource in_other_order_;  ///< of quaternions
  MocapFrame other_frame_;
  bool other_is_complete_ = false;
  std::set<int> known_ids_;
  Observation seen_;
};

}  // namespace softarm
