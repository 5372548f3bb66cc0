// Records the messages of a running arm for the pre-run checks.
#pragma once

#include <set>

#include "softarm/client/arm_client.hpp"
#include "softarm/commissioning/preflight/observation.hpp"
#include "softarm/transport/mocap_source.hpp"

namespace softarm {

/// Builds an Observation. Takes the client's callbacks for messages, frames, measured pressures and
/// commands; the client must not handle messages after the observer is destroyed.
class Observer {
 public:
  /// Begins to observe. @param client  must outlive the observer
  explicit Observer(ArmClient& client);
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  /// Marks the end of the time in which we command nothing.
  void rest_ends() { seen_.rest_end_ns = client_.now_ns(); }
  /// Adds a pulse that was played.
  void add(const Pulse& pulse) { seen_.pulses.push_back(pulse); }
  /// Everything observed so far.
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
