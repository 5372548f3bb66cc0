// One motion-capture frame as the core sees it: no ids, no channels, times already on our clock.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>

#include "softarm/model/arm.hpp"

namespace softarm {

/// The base and the end of every segment.
inline constexpr int kMaxBodies = kMaxSegments + 1;

/// Pose of one body in the world of the motion capture: p_world = orientation * p_body +
/// position_m.
struct BodyPose {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< q and -q mean the same
  bool valid = false;  ///< false: not seen in this frame, position and orientation mean nothing
};

/// All bodies at one instant. body[0] is the base frame S_0 (from the frame, or fixed by
/// configuration), body[i] the frame S_i at the end of segment i; bodies beyond `segments` are not
/// looked at.
struct MocapFrame {
  std::int64_t frame_number = 0;  ///< counts up by one a frame
  std::int64_t capture_ns = 0;    ///< instant of exposure on our monotonic clock
  int segments = 0;               ///< n; n + 1 bodies
  std::array<BodyPose, kMaxBodies> body;
};

}  // namespace softarm
