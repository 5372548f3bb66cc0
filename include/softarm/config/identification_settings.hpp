// Settings of `softarm identify`: the steps it plays, and the terms it found beyond the
// controller's model. config/template.yaml documents every setting.
#pragma once

#include <vector>

namespace softarm {

/// The steps that `softarm identify` plays, and the model it fits.
struct IdentificationSettings {
  std::vector<double> steps_bar = {0.2, 0.4, 0.6};
  double hold_s = 2.0;

  // Terms that the controller does not use, for predicting a recorded motion.
  std::vector<double> rest_u_rad;  ///< 2n: where the springs rest; empty: straight
  double cubic_nm_per_rad3 = 0.0;
  double lag_s = 0.0;
  double dead_time_s = 0.0;
};

}  // namespace softarm
