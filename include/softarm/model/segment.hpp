// One constant-curvature segment in u = theta [cos phi, sin phi]: (1) to (5) without a division by
// theta.
#pragma once

#include <Eigen/Core>

namespace softarm {

/// Rotation R of S_i relative to S_{i-1}: R = I + c1 [w]x + c2 [w]x^2 with w = (-u_y, u_x, 0). (1)
Eigen::Matrix3d segment_rotation(const Eigen::Vector2d& u_rad) noexcept;

/// The segment's tip in S_{i-1}: t = L (c2 u, c1), in m. (1)
Eigen::Vector3d segment_tip(double length_m, const Eigen::Vector2d& u_rad) noexcept;

/// The segment's centre of mass in S_{i-1}: L (c3 u, c2), in m, the mean of the homogeneous arc.
/// (5)
Eigen::Vector3d segment_centre(double length_m, const Eigen::Vector2d& u_rad) noexcept;

/// The point at arc fraction x in [0, 1] in S_{i-1}: x L (x c2(x^2 s) u, c1(x^2 s)), in m.
Eigen::Vector3d segment_point(double length_m, const Eigen::Vector2d& u_rad,
                              double arc_fraction) noexcept;

/// Columns: angular velocity of S_i relative to S_{i-1} for unit u', 3 x 2, in S_{i-1}.
Eigen::Matrix<double, 3, 2> segment_angular_jacobian(const Eigen::Vector2d& u_rad) noexcept;

}  // namespace softarm
