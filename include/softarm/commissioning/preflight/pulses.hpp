// Fills one chamber after the other at low pressure on the running arm.
#pragma once

#include <functional>
#include <string>

#include "softarm/commissioning/preflight/observer.hpp"

namespace softarm {

/// The pulse played on every chamber in turn.
struct PulsePlan {
  double pressure_bar = 0.0;  ///< above actuation.min_pressure_bar; 0: soft_pressure_bar
  double hold_s = 0.6;        ///< two thirds to settle, one third to measure
};

/// Plays a pulse on every chamber, adds each to the observation of `observer`, and vents the arm at
/// the end. Returns why it ended early, for a person; empty if it did not. It ends early if
///  - `stop` returns true (Ctrl-C), a daemon reports that it is armed, or another program commands
///    the arm,
///  - a segment bends beyond identification.max_theta_rad or moves faster than max_speed_radps,
///  - no frame shows every segment for 0.2 s, or as long as the daemon would wait before it vents.
/// @param client  holds the lock on the command channel  @throws TransportError
std::string play_pulses(ArmClient& client, Observer& observer, const PulsePlan& plan,
                        const std::function<bool()>& stop,
                        const std::function<void(const std::string&)>& progress);

}  // namespace softarm
