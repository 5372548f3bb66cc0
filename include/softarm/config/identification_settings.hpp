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
  double load_kg = 0.0;  ///< a point mass at the tip
  bool inertia = true;   ///< false: none, for quasi-static motion
  // Of every chamber; all 0: none.
  std::vector<double> push_nm_per_bar;  ///< pairs, generalized force in u; all 0: as `actuation`
  std::vector<double> fill_lag_s, vent_lag_s;  ///< all 0: lag_s
  std::vector<double> saturation_1pbar;
  double stiffening_1pbar = 0.0, stiffening_by_length = 0.0;
  std::vector<double> cross_nm_per_bar;  ///< chambers x 2n
  std::vector<double> slip_radius_rad = {0.0}, slip_stiffness_nm_per_rad = {0.0};
  double remanence = 0.0, remanence_s = 30.0;
  double remanence_2 = 0.0, remanence_2_s = 5.0;
  std::vector<double> remanent_u_rad;  ///< 2n
  // How the segments stretch. All gains 0: not known.
  std::vector<double> stretch_m_per_bar;  ///< chambers x n
  std::vector<double> stretch_length_m;   ///< n: without pressure
  std::vector<double> stretch_fill_s, stretch_vent_s, stretch_saturation_1pbar;
  double stretch_friction_m = 0.0, stretch_remanence = 0.0, stretch_remanence_s = 30.0;
  double stretch_remanence_2 = 0.0, stretch_remanence_2_s = 5.0;
  double stretch_set = 0.0, stretch_by_bend_m_per_rad2 = 0.0;
};

}  // namespace softarm
