// The pre-run checks: pure functions from an observation to what is wrong and how to fix it.
#pragma once

#include <vector>

#include "softarm/commissioning/preflight/findings.hpp"
#include "softarm/commissioning/preflight/observation.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

// Names of findings that decide about other checks.
inline constexpr const char* kBodies = "bodies";
inline constexpr const char* kAccepted = "accepted";
inline constexpr const char* kStillCheck = "still";
inline constexpr const char* kUnits = "units";
inline constexpr const char* kOrder = "order";
inline constexpr const char* kQuaternions = "quaternions";
inline constexpr const char* kWorldAxes = "world axes";

/// Mean poses over an interval of time, and how often each body was seen.
struct MeanPoses {
  std::vector<BodyPose> body;  ///< n + 1, base first; valid if seen at least once
  std::vector<double> seen;    ///< fraction of the frames that show the body
  int frames = 0;
};
/// Mean poses over the frames that arrived within [from_ns, to_ns), by MeanPose; an orientation has
/// the mean length of its quaternions.
/// @param bodies  n + 1  @param poses  which reading of the quaternions
MeanPoses mean_poses(const Observation& seen, std::int64_t from_ns, std::int64_t to_ns, int bodies,
                     std::vector<BodyPose> SeenFrame::*poses = &SeenFrame::body);

/// Checks frames, rate, jitter and latency, from arrivals and stamps.
std::vector<Finding> check_timing(const Experiment& experiment, const Observation& seen);

/// Checks rest, units, order along the arm, world axes and lengths from positions, and quaternions,
/// handedness and rest pose from positions and orientations.
std::vector<Finding> check_geometry(const Experiment& experiment, const Observation& seen);

/// Checks measured pressures, valve map and leaks. The valve map depends on curvature, so it is
/// only checked if none of the findings in `geometry` that it needs failed.
std::vector<Finding> check_valves(const Experiment& experiment, const Observation& seen,
                                  const std::vector<Finding>& geometry);

/// Checks what the daemon's own validator makes of the frames: below 90 % accepted fails with the
/// commonest verdict, or is not checked where one of `findings` failed, which may be why. Else it is
/// added to the text of the first finding.
void check_acceptance(const Experiment& experiment, const Observation& seen,
                      std::vector<Finding>& findings);

/// All checks, in this order.
std::vector<Finding> preflight(const Experiment& experiment, const Observation& seen);

/// Why the arm cannot be moved safely, from the findings at rest; empty if it can: bodies, units,
/// order, quaternions and world axes must not have failed.
std::string obstacle_to_pulses(const std::vector<Finding>& at_rest);

/// Pressure in bar above actuation.min_pressure_bar at which one chamber bends its segment by about
/// 0.15 rad.
double soft_pressure_bar(const Experiment& experiment, int segment, int chamber);

}  // namespace softarm
