// The only commander of an arm, while a tool plays pressures on it.
#pragma once

#include <cstdint>
#include <softarm_messages/pressure_command_t.hpp>

#include "softarm/actuation/pressure_ramps.hpp"
#include "softarm/base/instance_lock.hpp"
#include "softarm/config/experiment.hpp"
#include "softarm/transport/lcm_node.hpp"

namespace softarm {

/// Sends set points, 100 a second, within the configured limits of pressure and slew. Holds the
/// daemon's own lock on the command channel: neither runs beside the other. Whoever holds the
/// valves vents by itself when we fall silent (daemon.lcm.command_validity_s).
class Commander {
 public:
  static constexpr const char* kHeldUp =
      "this program was held up for longer than daemon.lcm.command_validity_s, so the valves "
      "vented";
  /// @throws OtherInstance where softarmd, or another such tool, commands this arm already
  Commander(const Experiment& experiment, LcmNode& node);

  /// Moves every pressure towards `wanted_bar` by at most the slew for the time since the last
  /// call, at most `rate_bar_per_s`, and sends them when they are due; from zero where the command
  /// before is no longer valid. @throws TransportError
  void update(const PressureVector& wanted_bar, double rate_bar_per_s, std::int64_t now_ns);
  /// The same towards 0 bar, at actuation.vent_bar_per_s.
  void vent(std::int64_t now_ns);
  /// Vents to the end and goes on commanding 0 bar for a second; messages are handled meanwhile.
  void vent_to_rest();

  const PressureVector& sent_bar() const { return bar_; }
  /// A command came after the one before was no longer valid: the valves have vented meanwhile, and
  /// what the arm did since is no answer to what was commanded.
  bool held_up() const { return held_up_; }
  std::int64_t next_ns() const { return next_ns_; }
  int chambers() const { return static_cast<int>(bar_.size()); }

 private:
  double step_s(std::int64_t now_ns);
  void send(std::int64_t now_ns);

  InstanceLock lock_;
  LcmNode& node_;
  const Experiment& experiment_;
  PressureRamps vent_ramps_;
  PressureVector bar_;
  bool held_up_ = false;
  std::int64_t period_ns_, next_ns_ = 0, updated_ns_ = 0;
  softarm_messages::pressure_command_t message_;
};

}  // namespace softarm
