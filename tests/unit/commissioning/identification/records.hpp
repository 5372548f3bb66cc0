// One-segment arms and motions for the tests of identification.
#pragma once

#include <cmath>

#include "softarm/commissioning/identification/parameter_set.hpp"
#include "softarm/simulation/arm_plant.hpp"
#include "softarm/simulation/random.hpp"

namespace softarm::test {

inline Experiment one_segment() {
  Experiment experiment;
  experiment.arm.segments = {{0.11, 0.15, 0.626, 0.029}};
  experiment.actuation.segments = {{{0.0, 0.8}, {M_PI / 2, 0.8}, {M_PI, 0.8}, {1.5 * M_PI, 0.8}}};
  experiment.plant.arm = experiment.arm;
  experiment.plant.actuation = experiment.actuation;
  experiment.plant.initial_u_rad.setZero(2);
  return experiment;
}

/// Ten frames of rest, then `steps` of `bar` on the chambers in turn, `hold_s` each, of an arm that
/// is seen without noise.
inline MotionRecord plant_record(const Experiment& experiment, int steps, double bar, double hold_s,
                                 double rate_hz) {
  PlantSettings settings = experiment.plant;
  settings.method = IntegratorMethod::cash4;
  settings.max_step_s = 0.0;
  settings.relative_tolerance = 1e-10;
  settings.absolute_tolerance = 1e-12;
  ArmPlant plant(settings);
  const auto per_step = static_cast<Eigen::Index>(std::lround(hold_s * rate_hz));
  constexpr Eigen::Index kRest = 10;
  const Eigen::Index frames = kRest + steps * per_step + 1;
  MotionRecord out;
  out.time_s.resize(frames);
  out.u_rad.resize(frames, plant.dof());
  out.input.time_s.setZero(steps + 1);
  out.input.value.setZero(steps + 1, plant.chambers());
  for (Eigen::Index k = 0; k < frames; ++k) {
    out.time_s[k] = static_cast<double>(k) / rate_hz;
    plant.advance(out.time_s[k]);
    out.u_rad.row(k) = plant.u_rad();
    const Eigen::Index step = (k - kRest) / per_step;
    if (k < kRest || (k - kRest) % per_step != 0 || step >= steps) continue;
    out.input.time_s[step + 1] = out.time_s[k];
    out.input.value(step + 1, step % plant.chambers()) =
        bar * (1.0 + static_cast<double>(step / plant.chambers()));
    const Eigen::VectorXd command = out.input.value.row(step + 1);
    plant.command({command.data(), static_cast<std::size_t>(command.size())});
  }
  return out;
}

/// Adds noise of `deviation_rad` to every number, each `colour` times the one before plus white.
inline void add_noise(MotionRecord& record, double deviation_rad, double colour,
                      std::uint64_t seed) {
  RandomNumbers random(seed);
  for (Eigen::Index c = 0; c < record.u_rad.cols(); ++c) {
    double noise = random.normal();
    for (Eigen::Index k = 0; k < record.u_rad.rows(); ++k) {
      record.u_rad(k, c) += deviation_rad * noise;
      noise = colour * noise + std::sqrt(1.0 - colour * colour) * random.normal();
    }
  }
}

}  // namespace softarm::test
