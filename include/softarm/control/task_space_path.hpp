// Where the tip should be: points, circles and the lemniscate (22). Times count from the beginning
// of the phase.
#pragma once

#include <string>

#include "softarm/control/inverse_kinematics.hpp"
#include "softarm/control/settings.hpp"

namespace softarm {

/// p_d, p_d', p_d'' in the world frame.
TipReference evaluate(const TipPathReference& path, double time_s) noexcept;

/// How far the path goes from a point, at 720 instants of its period.
double largest_distance_m(const TipPathReference& path, const Eigen::Vector3d& from_m) noexcept;

/// Throws std::invalid_argument, starting with `where`, for numbers that are not finite.
void check_tip_path(const std::string& where, const TipPathReference& path);

}  // namespace softarm
