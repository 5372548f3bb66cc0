// Where the tip should be: points, circles and the lemniscate (22). Times count from the beginning
// of the phase.
#pragma once

#include "softarm/control/inverse_kinematics.hpp"
#include "softarm/control/settings.hpp"

namespace softarm {

/// p_d, p_d', p_d'' in the world frame.
TipReference evaluate(const TipPathReference& path, double time_s) noexcept;

/// How far the path goes from a point, at 720 instants of its period.
double largest_distance_m(const TipPathReference& path, const Eigen::Vector3d& from_m) noexcept;

}  // namespace softarm
