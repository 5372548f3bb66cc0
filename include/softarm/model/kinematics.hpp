// Forward kinematics of the whole arm and the Jacobians of its tip. World frame, metres, radians,
// u-coordinates.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>

#include "softarm/model/arm.hpp"

namespace softarm {

using JacobianRef = Eigen::Ref<Eigen::Matrix3Xd>;

/// World pose of every segment's end: segment_ends[i] = T_base T_1 ... T_{i+1}. (1)
/// @param u 2n; @param segment_ends n poses, written.
void forward_kinematics(const ArmParameters& arm, ConstVectorRef u,
                        std::span<Eigen::Isometry3d> segment_ends) noexcept;

/// World position of every segment's centre of mass, 3 x n, in m. (5)
void mass_centres(const ArmParameters& arm, ConstVectorRef u, JacobianRef centres) noexcept;

/// World position of the arm's tip, in m.
Eigen::Vector3d tip_position(const ArmParameters& arm, ConstVectorRef u) noexcept;

/// World pose of the arm's tip.
Eigen::Isometry3d tip_pose(const ArmParameters& arm, ConstVectorRef u) noexcept;

/// J = d tip / d u, 3 x 2n, in m/rad, world frame.
void tip_jacobian(const ArmParameters& arm, ConstVectorRef u, JacobianRef jacobian) noexcept;

/// dJ/dt along `velocity` (2n, rad/s), 3 x 2n.
void tip_jacobian_rate(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef velocity,
                       JacobianRef jacobian_rate) noexcept;

/// J and dJ/dt at once.
void tip_jacobians(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef velocity,
                   JacobianRef jacobian, JacobianRef jacobian_rate) noexcept;

/// Angular velocity of S_n in the world for unit u', 3 x 2n.
void tip_angular_jacobian(const ArmParameters& arm, ConstVectorRef u,
                          JacobianRef jacobian) noexcept;

}  // namespace softarm
