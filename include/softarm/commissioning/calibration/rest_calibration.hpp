// Calibration from an arm at rest: the marker frames, that is the poses of S_i on the tracked
// bodies.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "softarm/config/experiment.hpp"
#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/estimation/pose_statistics.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {

/// The source of S_0; the shape at rest is relative to it.
enum class BaseSource {
  marker_frame,  ///< that of the base as configured, on its body (or arm.base if it is fixed)
  arm            ///< the same position, but with the axis of the arm along arm.base.rotation
};

/// The measured configuration of one segment at rest.
struct RestReading {
  Eigen::Vector2d u_rad = Eigen::Vector2d::Zero();
  double twist_rad = 0.0;
  double length_error_m = 0.0;
  bool valid = false;  ///< false: no bend fits its pose
};

/// The result of a calibration.
struct RestCalibration {
  std::vector<PoseStatistics> body;  ///< base first; no frames for a fixed base
  Eigen::VectorXd rest_u_rad;        ///< 2n: shape of the model at rest without pressure
  BodySettings bodies;               ///< as configured, with the marker frames found
  double base_tilt_rad = 0.0;        ///< of S_0's axis from arm.base.rotation, as configured
  std::vector<RestReading> before;   ///< of every segment, with the configured marker frames
  /// Of the second half of the frames, with the marker frames from the first half alone.
  std::vector<RestReading> after;
};

/// Finds the marker frames. With B_i the mean pose of body i and T_i(u) the pose of S_i in S_0:
///   plate_i = B_i^-1 S_0 T_i(u_rest).
/// @param frames  poses of the bodies themselves; only frames that show every body count
/// @throws std::runtime_error, with numbers and the fix, if there are too few or the arm moves
RestCalibration calibrate_rest(const Experiment& experiment, const std::vector<MocapFrame>& frames,
                               BaseSource base);

/// The result for a person, including what an arm at rest cannot determine.
std::string calibration_text(const Experiment& experiment, const RestCalibration& found);

/// An experiment file that includes `config` and has the marker frames; `note` becomes its first
/// line.
std::string calibrated_yaml(const RestCalibration& found, const std::string& note,
                            const std::string& config);

}  // namespace softarm
