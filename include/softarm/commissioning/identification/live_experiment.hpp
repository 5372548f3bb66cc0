// The step experiments on a running arm over LCM, within limits.
#pragma once

#include <functional>
#include <string>

#include "softarm/commissioning/identification/motion_record.hpp"
#include "softarm/commissioning/identification/step_response.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// What came of the steps on a running arm.
struct LiveOutcome {
  MotionRecord record;
  std::string aborted;  ///< why, for a person; empty where all steps were played
};

/// Plays the steps on the command channel of the experiment, 100 commands a second within the
/// configured slew, and records the frames of its mocap channel. The arm is vented, and the
/// experiment over, where
///  - `stop` says so (Ctrl-C), a daemon reports that it is armed, or somebody else commands the
///  arm,
///  - a segment bends beyond identification.max_theta_rad or moves faster than max_speed_radps
///    (over the last 50 ms),
///  - no frame shows every segment for 0.2 s.
/// After venting zero is sent for a second; whoever holds the valves vents by itself should we die
/// before (command_validity_s). No other controller may command the arm meanwhile: the daemon's
/// lock on the command channel is taken, and others are listened for.
/// @throws TransportError; OtherInstance; std::runtime_error where somebody else commands the arm,
/// frames do not come within 5 s, the arm moves already, or moments would be asked of a real valve
LiveOutcome play_steps(const Experiment& experiment, const StepPlan& plan,
                       const std::function<bool()>& stop,
                       const std::function<void(const std::string&)>& progress);

}  // namespace softarm
