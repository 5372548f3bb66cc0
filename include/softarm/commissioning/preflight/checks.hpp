// The checks before a flight: pure functions from what was seen to what is wrong and how to mend
// it.
#pragma once

#include <vector>

#include "softarm/commissioning/preflight/findings.hpp"
#include "softarm/commissioning/preflight/observation.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

// Names of the findings that others ask for.
inline constexpr const char* kBodies = "bodies";
inline constexpr const char* kStillCheck = "still";
inline constexpr const char* kUnits = "units";
inline constexpr const char* kOrder = "order";
inline constexpr const char* kQuaternions = "quaternions";
inline constexpr const char* kWorldAxes = "world axes";

/// Mean poses of a stretch of time, and how often each body was seen.
struct MeanPoses {
  std::vector<BodyPose> body;  ///< n + 1; valid where seen at least once
  std::vector<double> seen;    ///< parts of the frames
  int frames = 0;
};
/// Over the frames that arrived within [from_ns, to_ns), by MeanPose; an orientation has the mean
/// length of its quaternions. `bodies` is n + 1.
MeanPoses mean_poses(const Observation& seen, std::int64_t from_ns, std::int64_t to_ns, int bodies,
                     std::vector<BodyPose> SeenFrame::*poses = &SeenFrame::body);

/// Frames, rate, jitter and latency, from arrivals and stamps.
std::vector<Finding> check_timing(const Experiment& experiment, const Observation& seen);

/// Rest, units, order along the arm, world axes and lengths from positions; quaternions, handedness
/// and rest pose from both.
std::vector<Finding> check_geometry(const Experiment& experiment, const Observation& seen);

/// Measured pressures, valve map and leaks. The map reads curvature, so it is only looked at where
/// none of `geometry` failed.
std::vector<Finding> check_valves(const Experiment& experiment, const Observation& seen,
                                  const std::vector<Finding>& geometry);

/// All of them, in this order.
std::vector<Finding> preflight(const Experiment& experiment, const Observation& seen);

/// Why the arm cannot be moved safely for what was found at rest; empty where it can: bodies,
/// units, order, quaternions and world axes must not have failed.
std::string obstacle_to_pulses(const std::vector<Finding>& at_rest);

/// Pressure above the least that bends a segment alone by about 0.15 rad, in bar.
double soft_pressure_bar(const Experiment& experiment, int segment, int chamber);

}  // namespace softarm
