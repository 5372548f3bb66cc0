// Which points the tip can reach.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "softarm/model/arm.hpp"
#include "softarm/model/coordinates.hpp"

namespace softarm {

/// Distance in m from `target_m` (world) to the nearest point that is found for the tip with at most
/// `max_theta_rad` a segment, in the plane of a planar arm. By damped least squares on the tip's
/// Jacobian, from several poses; so a little above the true distance at worst. For load time.
/// @param u_rad 2n (3n where segments stretch); in: a pose to start from too, out: the pose that was
/// found @param most_elongation_m n, of segments that stretch: e is between 0 and that
double distance_out_of_reach_m(const ArmParameters& arm, double max_theta_rad,
                               std::optional<double> plane_rad, const Eigen::Vector3d& target_m,
                               Eigen::VectorXd& u_rad,
                               const SegmentScalars& most_elongation_m = {});

}  // namespace softarm
