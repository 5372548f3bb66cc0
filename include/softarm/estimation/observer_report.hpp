// What the model-based observer knows beyond u and u': values and standard deviations, for statuses
// and summaries.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "softarm/model/coordinates.hpp"
#include "softarm/model/model_correction.hpp"

namespace softarm {

/// One instant of the observer.
struct ObserverReport {
  int segments = 0;
  bool running = false;    ///< false: the kinematic filter serves
  bool surprised = false;  ///< for 25 ms innovations have been larger than the covariance explains
  bool wrong_model = false;    ///< a parameter stands at its limit
  std::int64_t failures = 0;   ///< times that it had to start again
  double nis = 1.0;            ///< the newest innovation's square, a component; 1 on the average
  ModelCorrection correction;  ///< parameters and disturbance
  ModelCorrection deviation;   ///< their standard deviations
  /// e of every segment at the newest frame (m), and its standard deviation; empty where segments
  /// do not stretch, and the axial members of the corrections then are zero.
  SegmentScalars elongation_m, elongation_deviation_m;
  /// A force on the end of the configured segment that the disturbance amounts to (N, world frame),
  /// and its covariance; zero where forces are not estimated.
  Eigen::Vector3d force_n = Eigen::Vector3d::Zero();
  Eigen::Matrix3d force_covariance_n2 = Eigen::Matrix3d::Zero();
  bool contact = false;        ///< something pushes
  bool pressure_loss = false;  ///< what looked like a push is a pressure that is not there
};

}  // namespace softarm
