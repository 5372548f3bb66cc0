// What an experiment says about `softarm identify`: the steps it plays, the limits it keeps, and
// what it found beyond the controller's own model.
#pragma once

#include <vector>

namespace softarm {

/// The steps that `softarm identify` plays, and the model it fits.
struct IdentificationSettings {
  std::vector<double> steps_bar = {0.2, 0.4, 0.6};  ///< on every side in turn, as in VII-B1
  double hold_s = 2.0;                              ///< from step to step
  double max_theta_rad = 1.5;     ///< a segment that bends farther ends the experiment
  double max_speed_radps = 20.0;  ///< so does one that moves faster

  // Terms that the controller does not know, for predicting a recorded motion.
  std::vector<double> rest_u_rad;  ///< 2n: where the springs rest; empty: straight
  double cubic_nm_per_rad3 = 0.0;  ///< adds cubic |u - rest|^2 (u - rest) to K u
  double lag_s = 0.0;              ///< first order, from a set point to what bends the arm
  double dead_time_s = 0.0;        ///< from a set point until a frame can show it
};

}  // namespace softarm
