// Filling one chamber after the other, softly, on the running arm.
#pragma once

#include <functional>
#include <string>

#include "softarm/client/arm_listener.hpp"
#include "softarm/client/commander.hpp"

namespace softarm {

struct PulsePlan {
  double pressure_bar = 0.0;  ///< above actuation.min_pressure_bar; 0: soft_pressure_bar
  double hold_s = 0.6;        ///< two thirds to settle, one third to measure
};

/// Plays a pulse on every chamber and writes them into `listener.seen().pulses`; the arm is vented
/// in the end. Returns why it ended early, for a person; empty where it did not. It ends where
///  - `stop` says so (Ctrl-C), or a daemon says that it is armed,
///  - a segment bends beyond identification.max_theta_rad or moves faster than max_speed_radps,
///  - no frame shows every segment for 0.2 s, or as long as the daemon would wait before it vents.
/// @throws TransportError
std::string play_pulses(const Experiment& experiment, const PulsePlan& plan, LcmNode& node,
                        ArmListener& listener, Commander& commander,
                        const std::function<bool()>& stop,
                        const std::function<void(const std::string&)>& progress);

}  // namespace softarm
