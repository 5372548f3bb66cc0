// The paper's step experiments, and the response of the simulated arm to them as motion capture
// sees it.
#pragma once

#include <vector>

#include "softarm/commissioning/identification/motion_record.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// Steps on every side of all segments at once, one after the other, in all sizes: pressures of
/// `identification.steps_bar`, with actuation by torque thirds of `bend_rad`.
struct StepPlan {
  double bend_rad =
      0.5;              ///< the moment of the largest that the configured stiffness balances there
  double hold_s = 2.0;  ///< from step to step
};

/// The set points of every valve, step after step, within the limits of the configuration.
std::vector<std::vector<double>> step_commands(const Experiment& experiment, const StepPlan& plan);

/// Drives the configured plant, from its initial pose at rest, without any control. Frames that are
/// lost are left out; those that come carry their own time.
/// @throws PlantError; std::runtime_error if so many frames are lost that nothing can be told
MotionRecord record_step_response(const Experiment& experiment, const StepPlan& plan);

}  // namespace softarm
