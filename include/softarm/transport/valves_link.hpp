// The valve driver's side of LCM: commands in, measured pressures and status out.
#pragma once

#include <cstdint>
#include <softarm_messages/operator_command_t.hpp>
#include <softarm_messages/pressure_command_t.hpp>
#include <softarm_messages/pressure_measurement_t.hpp>
#include <softarm_messages/valves_status_t.hpp>
#include <vector>

#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/settings.hpp"
#include "softarm/valves/valve_driver.hpp"

namespace softarm {

/// Passes commands and emergency stops to the driver, which vents while no daemon runs too, and
/// publishes its measurements and status. Use from the driver's
/// thread. After construction nothing allocates or throws.
class ValvesLink {
 public:
  /// Commands go to `driver`, which must outlive this. @throws TransportError
  ValvesLink(const LcmSettings& lcm, ValveDriver& driver);

  /// Takes commands as they arrive until `deadline_ns` of CLOCK_MONOTONIC, so that their validity
  /// counts from their arrival.
  void take_until(std::int64_t deadline_ns) noexcept;
  /// Empties the queue of commands: takes or discards them.
  void drain(bool take) noexcept;

  /// Publishes the pressures that the driver has just read back.
  void publish_measurement(std::int64_t now_ns) noexcept;
  /// Publishes state and counters when state, reason or chamber have changed, and ten times a
  /// second. Returns whether they have changed.
  bool publish_status(std::int64_t now_ns, std::int64_t late_cycles) noexcept;

  /// Commands that were malformed, for another arm, or, on one machine, not of this moment; and
  /// requests that were malformed.
  std::int64_t refused() const noexcept { return refused_; }

 private:
  void take(const ReceivedMessage& packet) noexcept;
  void take_request(const ReceivedMessage& packet) noexcept;

  LcmSettings lcm_;
  ValveDriver& driver_;
  LcmNode node_;
  std::vector<double> pressure_bar_;
  bool local_;  ///< senders read our monotonic clock
  bool discarding_ = false;
  std::int64_t refused_ = 0;
  std::int64_t next_status_ns_ = 0;
  softarm_messages::pressure_command_t command_{};
  softarm_messages::operator_command_t request_{};
  softarm_messages::pressure_measurement_t measurement_{};
  softarm_messages::valves_status_t status_{};
};

}  // namespace softarm
