// A run of the plant with its energies accounted for.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "softarm/simulation/arm_plant.hpp"

namespace softarm {

struct Outcome {
  SegmentVector u;
  Eigen::VectorXd x;         ///< all coordinates
  double imbalance_j = 0.0;  ///< largest of |stored - supplied + dissipated|
  IntegratorCounters counters;
};

/// Holds `pressures` (none: vented) for duration_s and looks at the balance of energies `looks`
/// times on the way.
inline Outcome balanced_run(PlantSettings settings, const std::vector<double>& pressures,
                            double duration_s, int looks) {
  settings.account_energy = true;
  ArmPlant plant(settings);
  if (!pressures.empty()) plant.command(pressures);
  const PlantEnergies start = plant.energies();
  Outcome result;
  for (int k = 1; k <= looks; ++k) {
    plant.advance(duration_s * k / looks);
    const PlantEnergies now = plant.energies();
    const double stored = now.kinetic + now.potential - start.kinetic - start.potential;
    result.imbalance_j =
        std::max(result.imbalance_j, std::abs(stored - now.supplied + now.dissipated));
  }
  result.u = plant.u_rad();
  result.x = plant.coordinates();
  result.counters = plant.counters();
  return result;
}

inline PlantSettings with_damping(PlantSettings settings, double factor) {
  for (SegmentParameters& segment : settings.arm.segments) {
    segment.damping_nms_per_rad *= factor;
    segment.axial_damping_ns_per_m *= factor;
  }
  return settings;
}

}  // namespace softarm
