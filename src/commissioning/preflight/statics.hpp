// Which moments hold the arm where it is seen: what the valve map and the rest pose are judged by.
#pragma once

#include <Eigen/Core>

#include "softarm/commissioning/preflight/checks.hpp"

namespace softarm {

/// u of every segment (2n, rad) from mean poses; false where one is not seen or has no curvature.
bool curvature_of(const Experiment& experiment, const MeanPoses& poses, Eigen::VectorXd& u_rad);

/// K u + G(u), 2n, in N m: the generalized force that holds the arm at u.
Eigen::VectorXd static_force_nm(const ArmParameters& arm, const Eigen::VectorXd& u_rad);

}  // namespace softarm
