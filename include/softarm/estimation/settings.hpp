// What an experiment may choose about sensing: the estimator, the filter, the checks of a frame.
// config/template.yaml documents every setting.
#pragma once

#include <optional>
#include <vector>

namespace softarm {

/// What u is taken from.
enum class CurvatureMethod {
  pose,         ///< position and orientation, weighted by both frames' noise
  orientation,  ///< orientation alone: inertial sensors
  printed       ///< the paper's (20) as printed, for comparison only
};

/// What u and u' at the tick come from.
enum class ObserverKind {
  kinematic,  ///< CurvatureFilter: a polynomial through the measurements, no model of the arm
  model       ///< ModelObserver: a Kalman filter on (16) with disturbance and parameters
};

/// Of the model-based observer; physical quantities, none of which needs tuning for a usual arm.
struct ModelObserverSettings {
  bool learn_parameters = true;
  double parameter_deviation = 0.2;
  double payload_deviation = 0.0;
  /// Horizontal load of every segment before anything was learnt, two numbers each (see
  /// SegmentCorrection); zero where there are fewer. And its standard deviation; none: parameter_deviation.
  std::vector<double> load;
  std::optional<double> load_deviation;
  double parameter_drift_per_sqrt_s = 5e-4;
  double disturbance_drift_per_sqrt_s = 3e-3;
  double largest_disturbance_drift_per_sqrt_s = 0.045;
};

/// From motion-capture frames to u: method, noise, and which frames are refused.
struct EstimationSettings {
  CurvatureMethod method = CurvatureMethod::pose;
  double position_noise_m = 0.2e-3;
  double orientation_noise_rad = 3.5e-3;
  bool base_is_fixed = false;  ///< the base is where arm.base says, not a measured body
  double filter_bandwidth_radps = 30.0;
  int predicted_frames = 3;
  ObserverKind observer = ObserverKind::kinematic;
  ModelObserverSettings model_observer;

  // A frame is rejected where it violates one of these.
  double quaternion_tolerance = 0.02;
  double length_tolerance = 0.3;
  double torsion_tolerance_rad = 0.5;
  double max_speed_radps = 50.0;
  // A body that repeats its pose in so many frames while others move counts as not seen; 0: off.
  int stale_frames = 5;
};

}  // namespace softarm
