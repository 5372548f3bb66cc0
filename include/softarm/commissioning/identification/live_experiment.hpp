// Step experiments on a running arm over LCM, within limits.
#pragma once

#include <functional>
#include <string>

#include "softarm/commissioning/identification/motion_record.hpp"
#include "softarm/commissioning/identification/step_response.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// The outcome of the steps on a running arm.
struct LiveOutcome {
  MotionRecord record;
  std::string aborted;  ///< why, for a person; empty if all steps were played
};

/// Plays the steps on the command channel of the experiment, 100 commands a second within the
/// configured slew rate, and records the frames of its motion-capture channel. The experiment ends,
/// and the arm is vented, if
///  - `stop` returns true (Ctrl-C), a daemon reports that it is armed, or another program commands
///    the arm,
///  - a segment bends beyond identification.max_theta_rad or moves faster than max_speed_radps
///    (over the last 50 ms),
///  - no frame shows every segment for 0.2 s.
/// After venting, zero is sent for a second; if this program dies before that, the valves vent by
/// themselves (daemon.lcm.command_validity_s). No other controller may command the arm meanwhile:
/// this takes the daemon's lock on the command channel and listens for other commands.
/// @throws TransportError; OtherInstance; std::runtime_error if another program commands the arm,
/// frames do not come within 5 s, the arm is not at rest, or actuation is by torque
LiveOutcome play_steps(const Experiment& experiment, const StepPlan& plan,
                       const std::function<bool()>& stop,
                       const std::function<void(const std::string&)>& progress);

}  // namespace softarm
