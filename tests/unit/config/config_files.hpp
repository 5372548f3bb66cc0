// Configuration files for tests: a separate folder for every test, and a good experiment to change.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "test_folder.hpp"

namespace softarm {

inline const std::filesystem::path kConfigFolder =
    std::filesystem::path(SOFTARM_SOURCE_DIR) / "config";

/// Uses most forms a value can take.
inline constexpr const char* kGoodExperiment = R"(name: good
seed: 7
arm:
  segments: 2
  length_m: [0.11, 0.12]
  mass_kg: 0.15
  stiffness_nm_per_rad: 0.626
  damping_nms_per_rad: 0.029
  mass_model: distributed
  base:
    position_m: [0, 0, 1]
    rotation: hanging
  gravity_mps2: [0, 0, -9.81]
actuation:
  chambers:
    angle_rad: [0, pi/2, pi, 3*pi/2]
    gain_nm_per_bar: 0.839
  min_pressure_bar: 0
  max_pressure_bar: 2
  vent_bar_per_s: 8
estimation:
  method: pose
  predicted_frames: 3
control:
  kp_nm_per_rad: [1, [1, 0.5]]
  kd_nms_per_rad: 0.002
  terms: {coriolis: true}
reference:
  - kind: set_point
    duration_s: 5
    theta_rad: 0.3
    phi_rad: [0, pi]
  - kind: way_points
    points:
      - {time_s: 0, theta_rad: 0}
      - {time_s: 2, theta_rad: 0.4}
daemon:
  rate_hz: 500
  bodies:
    base_id: 0
    segment_ids: [1, 2]
  safety:
    hold_overruns: 3
    vent_overruns: 10
  lcm:
    status_channel: STATUS
plant:
  mismatch: {stiffness_factor: 1.05}
  valves: {lag_s: 0.02}
run:
  duration_s: 20
)";

}  // namespace softarm
