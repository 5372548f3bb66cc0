// From an arm that hangs still: where on its marker plates the frames S_i sit.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "softarm/config/experiment.hpp"
#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/estimation/pose_statistics.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {

/// Where S_0 is taken from; the shape at rest is relative to it.
enum class BaseSource {
  plate,  ///< from the body of the base with the plate configured (or arm.base, where it is fixed)
  arm     ///< the same position, but the axis of the arm points where arm.base.rotation says
};

/// What one segment reads at rest.
struct RestReading {
  Eigen::Vector2d u_rad = Eigen::Vector2d::Zero();
  double twist_rad = 0.0;
  double length_error_m = 0.0;
  bool valid = false;  ///< false: its pose fits no bend
};

struct RestCalibration {
  std::vector<PoseStatistics> body;  ///< base first; a fixed base has seen no frames
  Eigen::VectorXd rest_u_rad;        ///< 2n: the shape that the model has at rest without pressure
  BodySettings bodies;               ///< as configured, with the plates found
  double base_tilt_rad = 0.0;  ///< of S_0's axis from arm.base.rotation, with the plate configured
  std::vector<RestReading> before;  ///< of every segment, with the plates configured
  /// The second half of the frames with the plates that the first half alone gives.
  std::vector<RestReading> after;
};

/// With B_i the mean pose of body i and T_i(u) the pose of S_i in S_0:
///   plate_i = B_i^-1 S_0 T_i(u_rest).
/// @param frames body poses, as with plates of zero; only those in which every body is seen count
/// @throws std::runtime_error, with numbers and cure, where there are too few, or the arm moves
RestCalibration calibrate_rest(const Experiment& experiment, const std::vector<MocapFrame>& frames,
                               BaseSource base);

/// What it found, and what a still arm cannot tell; for people.
std::string calibration_text(const Experiment& experiment, const RestCalibration& found);

/// An experiment that includes `config` and has the plates; `note` becomes its first line.
std::string calibrated_yaml(const Experiment& experiment, const RestCalibration& found,
                            const std::string& note, const std::string& config);

}  // namespace softarm
