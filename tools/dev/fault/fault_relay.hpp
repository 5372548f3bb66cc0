// Stands between sensors and daemon: what the sensors publish on channels with a suffix goes on,
// corrupted, to the channels the daemon listens to.
#pragma once

#include <atomic>
#include <mutex>
#include <softarm_messages/mocap_frame_t.hpp>
#include <softarm_messages/pressure_measurement_t.hpp>
#include <string>
#include <thread>

#include "dev/fault/fault_injector.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {

inline constexpr const char* kSensorSuffix = "_CLEAN";

/// Works in a separate thread from construction to destruction. Where it has a channel for them, it
/// passes the daemon's commands on to the valves too, or loses them. A message that cannot be decoded
/// does not go through.
class FaultRelay {
 public:
  /// `fifo_priority` > 0: under SCHED_FIFO, for a machine that is loaded. @throws TransportError
  FaultRelay(const LcmSettings& lcm, const std::string& suffix, int fifo_priority = 0,
             const std::string& valves_channel = {});

  /// From the next message on.
  void set(const Fault& fault);

  void lose_commands(bool lose) { loses_commands_ = lose; }

  std::int64_t frames_received() const { return frames_received_; }

 private:
  void work(const std::stop_token& stop);
  void send_what_is_due();

  LcmSettings lcm_;
  LcmNode node_;
  std::mutex mutex_;
  FaultInjector injector_;
  std::atomic<std::int64_t> frames_received_{0};
  std::atomic<bool> loses_commands_{false};
  softarm_messages::mocap_frame_t received_, sent_;
  softarm_messages::pressure_measurement_t measurement_;
  std::jthread thread_;
};

}  // namespace softarm
