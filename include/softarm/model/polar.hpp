// The paper's coordinates q = [phi_1, theta_1, ...] and the exact chain rule between them and u.
//
// u' = P q' with P_i = [[-theta sin phi, cos phi], [theta cos phi, sin phi]]. Angles are never
// wrapped here. Polar coordinates have no mass matrix at theta = 0, where P is singular.
#pragma once

#include <Eigen/Core>

#include "softarm/model/arm.hpp"

namespace softarm {

/// P of one segment, 2 x 2: columns d u / d phi and d u / d theta.
Eigen::Matrix2d polar_jacobian(const Eigen::Vector2d& q_rad) noexcept;

/// dP/dt of one segment along q'.
Eigen::Matrix2d polar_jacobian_rate(const Eigen::Vector2d& q_rad,
                                    const Eigen::Vector2d& velocity_radps) noexcept;

/// u = theta [cos phi, sin phi] of every segment, 2n.
void polar_to_u(ConstVectorRef q, VectorRef u) noexcept;

/// u' = P q'.
void polar_velocity_to_u(ConstVectorRef q, ConstVectorRef velocity, VectorRef u_velocity) noexcept;

/// u'' = P q'' + P' q'.
void polar_acceleration_to_u(ConstVectorRef q, ConstVectorRef velocity, ConstVectorRef acceleration,
                             VectorRef u_acceleration) noexcept;

/// q = [atan2(u_y, u_x), |u|] of every segment: theta >= 0, phi in (-pi, pi] and 0 where u = 0.
void u_to_polar(ConstVectorRef u, VectorRef q) noexcept;

/// q' = P^-1 u'; phi' is not finite where theta = 0.
void u_velocity_to_polar(ConstVectorRef q, ConstVectorRef u_velocity, VectorRef velocity) noexcept;

/// q'' = P^-1 (u'' - P' q'); phi'' is not finite where theta = 0.
void u_acceleration_to_polar(ConstVectorRef q, ConstVectorRef velocity,
                             ConstVectorRef u_acceleration, VectorRef acceleration) noexcept;

/// force_q = P' force_u: G, C q', tau and every other generalized force. `force_q` may alias
/// `force_u`.
void force_to_polar(ConstVectorRef q, ConstVectorRef force_u, VectorRef force_q) noexcept;

/// J_q = J_u P for any matrix of 2n columns, in place.
void jacobian_to_polar(ConstVectorRef q, Eigen::Ref<Eigen::MatrixXd> jacobian) noexcept;

/// J'_q = J'_u P + J_u P', in place; `jacobian` is still the one in u.
void jacobian_rate_to_polar(ConstVectorRef q, ConstVectorRef velocity,
                            const Eigen::Ref<const Eigen::MatrixXd>& jacobian_u,
                            Eigen::Ref<Eigen::MatrixXd> jacobian_rate) noexcept;

/// B_q = P' B P, C_q = P' (B P' + C P) with P' the rate, G_q = P' G; in place, 2n x 2n and 2n.
void dynamics_to_polar(ConstVectorRef q, ConstVectorRef velocity, Eigen::Ref<Eigen::MatrixXd> B,
                       Eigen::Ref<Eigen::MatrixXd> C, VectorRef G) noexcept;

/// A of one segment in polar, exactly: [[-r cos phi, -r sin phi], [-sin phi, cos phi]], r = sin
/// theta (`couple`, the paper's (15) corrected) or theta (`chamber`).
Eigen::Matrix2d polar_actuation_matrix(ActuationModel model, const Eigen::Vector2d& q_rad) noexcept;

}  // namespace softarm
