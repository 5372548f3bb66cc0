// What an experiment may choose about sensing: the estimator, the filter, the checks a frame must pass.
#pragma once

namespace softarm {

enum class CurvatureMethod {
  pose,         ///< position and orientation, weighted by both frames' noise
  orientation,  ///< orientation alone: inertial sensors
  printed       ///< the paper's (20) as printed, for comparison only
};

struct EstimationSettings {
  CurvatureMethod method = CurvatureMethod::pose;
  double position_noise_m = 0.2e-3;       ///< standard deviation an axis of every measured body
  double orientation_noise_rad = 3.5e-3;  ///< standard deviation of the rotation vector an axis of every measured body
  double filter_bandwidth_radps = 30.0;   ///< of the velocity filter on u
  int predicted_frames = 3;               ///< frames an occluded segment may be predicted for

  // A frame is rejected where it violates one of these.
  double quaternion_tolerance = 0.02;  ///< | |q| - 1 |
  double length_tolerance = 0.3;       ///< | |t| - chord | / L of a segment
  double max_speed_radps = 50.0;       ///< jump of u between frames, over the time between them
};

}  // namespace softarm
