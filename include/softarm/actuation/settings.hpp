// What an experiment says about the chambers of each segment and the limits of their valves.
#pragma once

#include <optional>
#include <vector>

namespace softarm {

/// A chamber at angle chi about the segment's axis: pressure p adds -gain p (cos chi, sin chi) to
/// the generalized force in u.
struct Chamber {
  double angle_rad = 0.0;
  double gain_nm_per_bar = 0.839;
};

struct ActuationSettings {
  std::vector<std::vector<Chamber>>
      segments;  ///< chambers of each segment, in the order of the valves
  double min_pressure_bar = 0.0;
  double max_pressure_bar = 2.0;
  double bias_pressure_bar = 0.0;   ///< where pressures rest that no torque asks to move
  double slew_bar_per_s = 40.0;     ///< largest rate of a commanded pressure
  double vent_bar_per_s = 8.0;      ///< rate of the ramp to zero when venting
  std::optional<double> plane_rad;  ///< a planar arm bends only in the plane at this phi
};

}  // namespace softarm
