// What an experiment says about the simulated arm: its parameters, valves, sensing and integrator.
#pragma once

#include <cstdint>
#include <string>

#include "softarm/actuation/settings.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// First-order valves between a commanded and a real pressure. Left out (lag 0): the command is the pressure.
struct ValveSettings {
  double lag_s = 0.0;               ///< time constant
  double supply_pressure_bar = 2.0; ///< no pressure above it
};

/// Simulated motion capture.
struct MocapSettings {
  double rate_hz = 200.0;
  double latency_s = 0.0;                ///< from capture to arrival of the message
  double position_noise_m = 0.0;         ///< standard deviation an axis of every body
  double orientation_noise_rad = 0.0;    ///< standard deviation of the rotation vector an axis of every body
  double dropout_probability = 0.0;      ///< of a whole frame, independent from frame to frame
  bool noise_on_base = true;             ///< the base is a measured body too, unless it is fixed
};

/// The simulated arm. Its `arm` and `actuation` may differ from what the controller believes.
struct PlantSettings {
  ArmParameters arm;
  ActuationSettings actuation;
  ValveSettings valves;
  MocapSettings mocap;
  SegmentVector initial_u_rad;              ///< at rest
  Eigen::Vector3d tip_force_n = Eigen::Vector3d::Zero();  ///< constant external force at the tip, world frame
  double relative_tolerance = 1e-6;         ///< of the SUNDIALS integrator
  double absolute_tolerance = 1e-8;         ///< rad and rad/s
  std::uint64_t seed = 1;
};

}  // namespace softarm
