// Shared by the checks of positions and of orientations.
#pragma once

#include <string>
#include <vector>

#include "commissioning/preflight/readings.hpp"
#include "softarm/commissioning/preflight/checks.hpp"

namespace softarm {

/// Mean poses at rest, and the pairs of poses of the pulses.
struct Poses {
  MeanPoses rest;
  std::vector<BentPair> bent;
};
/// @param poses  which reading of the quaternions
Poses poses_of(const Experiment& experiment, const Observation& seen,
               std::vector<BodyPose> SeenFrame::*poses);

/// The curvature that the controller's estimator finds for mean poses, 2n, rad. False if no bend
/// fits or a body was not seen.
bool curvature_of(const Experiment& experiment, const MeanPoses& poses, Eigen::VectorXd& u_rad);

/// "base", "end of segment 2"
std::string place(std::size_t body);

Finding check_still(const Experiment& experiment, const Observation& seen, const MeanPoses& rest);
Finding check_units(const Experiment& experiment, const MeanPoses& rest);
Finding check_order(const Experiment& experiment, const MeanPoses& rest);
Finding check_world_axes(const Experiment& experiment, const MeanPoses& rest);
/// @param curved  orientations may be used to distinguish chord and arc
Finding check_lengths(const Experiment& experiment, const MeanPoses& rest, bool curved);
/// @param other  poses with the quaternions in the order that is not configured
Finding check_quaternions(const Experiment& experiment, const Poses& poses, const Poses& other);
Finding check_handedness(const Poses& poses, const Poses& other);
Finding check_rest_pose(const Experiment& experiment, const MeanPoses& rest);

}  // namespace softarm
