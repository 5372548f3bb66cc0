// The step response of a simulated arm, as motion capture sees it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "softarm/config/experiment.hpp"

namespace softarm {

/// Steps on every side of all segments at once, one after the other, in three sizes.
struct StepPlan {
  double bend_rad = 0.5;  ///< the largest: the moment that the configured stiffness balances there
  double hold_s = 2.0;    ///< from step to step
};

/// Rows are instants, a period apart.
struct StepResponse {
  double period_s = 0.0;
  Eigen::MatrixXd u_rad;  ///< 2n columns, as estimated from frames, those lost interpolated
  Eigen::MatrixXd input;  ///< what acts behind the valves: bar of every chamber, or tau_A in N m
};

/// Drives the configured plant, from its initial pose at rest, without any control.
/// @throws PlantError; std::runtime_error if so many frames are lost that nothing can be told
StepResponse record_step_response(const Experiment& experiment, const StepPlan& plan);

}  // namespace softarm
