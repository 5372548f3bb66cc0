// The paper's step experiments, and the response of the simulated arm to them as motion capture
// sees it.
#pragma once

#include <vector>

#include "softarm/commissioning/identification/motion_record.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// Steps on every side of all segments at once, one side after the other, in all sizes: the
/// pressures of `identification.steps_bar`, or thirds of `bend_rad` where actuation is by torque.
struct StepPlan {
  double bend_rad = 0.5;  ///< the configured stiffness balances the largest moment at this bend
  double hold_s = 2.0;    ///< from step to step
};

/// The set points of every valve for each step, within the limits of the configuration; bar, or N
/// m.
std::vector<std::vector<double>> step_commands(const Experiment& experiment, const StepPlan& plan);

/// Plays the steps on the configured plant, from its initial pose at rest, without control. Lost
/// frames are left out; the others have their capture time.
/// @throws PlantError; std::runtime_error if more than half of the frames are lost
MotionRecord record_step_response(const Experiment& experiment, const StepPlan& plan);

}  // namespace softarm
