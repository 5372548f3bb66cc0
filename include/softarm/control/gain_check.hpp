// Do the configured gains leave the loop stable, given its delay and the valves' lag?
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "softarm/control/settings.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// Largest factor on the gains K_P, K_D with which the loop, linearized about the straight pose at
/// rest, is stable; 0 if it is unstable without them, at most 1e3. kp_u (N m/rad), kd_u (N m
/// s/rad): diagonals in u, 2n each. Not for the loop: allocates, solves eigenvalue problems of 6n
/// states.
///
/// The linearized loop of one bending plane is
///   B s^2 + beta s + k + G_u + H(s) (K_P + K_D s - G_u),   H(s) = e^(-s T) / (tau_v s + 1),
/// T = delay_s, tau_v = valve_lag_s, G_u the slope of gravity (the controller feeds G back late).
/// What is approximate: the delay is a Pade approximant of order (3,3) (phase exact to 2e-3 rad up
/// to w T = 2); B and G_u are those of the straight pose, planes do not couple; sampling and the
/// velocity filter are not in it unless delay_s counts them. A guide with a margin, not a proof.
double largest_gain_factor(const ArmParameters& arm, const ControllerSettings& settings,
                           const Eigen::VectorXd& kp_u, const Eigen::VectorXd& kd_u);

/// Slope of G at u (2n x 2n, N m/rad), by central differences. Not for the loop: allocates.
Eigen::MatrixXd gravity_slope(const ArmParameters& arm, const Eigen::VectorXd& u);

/// Compliance of the tip (m/N, world frame) against a small constant force on an arm at rest in u:
///   J (K + K_P + G_u)^-1 J'.
/// gravity_fed_back: the controller's G(u) takes G_u away, as (17) does; K_P = 0 and false is the
/// passive arm under constant torques. kp_u: diagonal, 2n.
/// @throws std::invalid_argument where sizes do not fit
Eigen::Matrix3d tip_compliance(const ArmParameters& arm, const Eigen::VectorXd& u,
                               const Eigen::VectorXd& kp_u, bool gravity_fed_back);

/// Texts for a person, none if all is well: gains (in polar coordinates K_P,phi / theta^2 at
/// `theta_rad`, the largest theta that the reference reaches) above what delay_s and valve_lag_s
/// allow, or within a factor 1.25 of it.
std::vector<std::string> gain_warnings(const ArmParameters& arm, const ControllerSettings& settings,
                                       double theta_rad);

}  // namespace softarm
