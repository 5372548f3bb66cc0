// Experiments of `softarm-dev bench control`, `bench stability` and `bench softness`: what is run.
#pragma once

#include <limits>

#include "softarm/config/experiment.hpp"

namespace softarm {

/// The same experiment with exact sensing.
Experiment without_noise(Experiment experiment);

/// How a run in lock step went.
struct TrackingTrial {
  double u_rms_rad = std::numeric_limits<double>::quiet_NaN();  ///< reference minus true u
  double tip_rms_m = std::numeric_limits<double>::quiet_NaN();
  bool stayed_active = true;  ///< from the first ACTIVE on
};
/// @param duration_s of the run; errors count from run.tracking_from_s after ACTIVE on
TrackingTrial track(const Experiment& experiment, double duration_s);

/// What becomes of a small blow on the tip of the straight arm under control, without noise.
struct KickedTrial {
  double growth_1ps = 0.0;  ///< of the deviation, from 0.3 to 2.8 s after the blow
  bool stable = true;       ///< it faded, and the arm stayed ACTIVE
};
KickedTrial kick(const Experiment& experiment);

/// Compliance of the tip (m/N) along the world's x axis: displacement by a small force, at rest.
/// `experiment` holds a pose.
double measured_tip_compliance(const Experiment& experiment, double force_n);

}  // namespace softarm
