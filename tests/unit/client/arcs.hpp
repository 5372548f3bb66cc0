// Poses of an arm whose segments are arcs, by elementary geometry.
#pragma once

#include <cmath>

#include "softarm/estimation/mocap_frame.hpp"

namespace softarm::test {

/// Every segment bent by `bend_rad` > 0 towards x of its upper end: its chord is 2 L / theta
/// sin(theta / 2) long and leans by theta / 2, its lower end is turned by theta about y.
inline MocapFrame bent_arm(const ArmParameters& arm, double bend_rad) {
  MocapFrame frame;
  frame.segments = arm.size();
  Eigen::Quaterniond orientation(arm.base_rotation);
  Eigen::Vector3d position_m = arm.base_position_m;
  frame.body[0] = {position_m, orientation, true};
  for (std::size_t i = 0; i < arm.segments.size(); ++i) {
    const double chord_m = 2.0 * arm.segments[i].length_m / bend_rad * std::sin(0.5 * bend_rad);
    position_m += orientation * (chord_m * Eigen::Vector3d(std::sin(0.5 * bend_rad), 0.0,
                                                           std::cos(0.5 * bend_rad)));
    orientation =
        orientation * Eigen::Quaterniond(Eigen::AngleAxisd(bend_rad, Eigen::Vector3d::UnitY()));
    frame.body[i + 1] = {position_m, orientation, true};
  }
  return frame;
}

}  // namespace softarm::test
