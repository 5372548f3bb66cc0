// Do the configured gains leave the loop stable, given its delay and the valves' lag?
#pragma once

#include <string>
#include <vector>

#include "softarm/control/settings.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// Largest factor on the gains K_P, K_D (2n each, diagonal, in u) with which the loop linearized
/// about the straight pose at rest is stable; 0 if it is unstable without them, capped at 1e3. Not
/// for the loop: allocates.
///
/// The linearized loop of one bending plane is
///   B s^2 + (beta I) s + k I + G_u + H(s) (K_P + K_D s - G_u),   H(s) = e^(-s T) / (tau_v s + 1),
/// with T = delay_s + half of what the caller adds for sampling, tau_v = valve_lag_s, G_u the slope
/// of gravity (the controller feeds G back late). H is taken with a Pade approximation of order
/// (3,3), exact to 1e-3 rad of phase up to w T = 2.5; stability is read from the eigenvalues. Away
/// from the straight pose B and G_u differ; take it as a guide with a margin, not as a proof. The
/// velocity filter is left out.
double largest_gain_factor(const ArmParameters& arm, const ControllerSettings& settings,
                           const Eigen::VectorXd& kp_u, const Eigen::VectorXd& kd_u);

/// Texts for a person, none if all is well: gains (in polar coordinates K_P,phi / theta^2 at
/// `theta_rad`, the largest theta that the reference reaches) above what delay_s and valve_lag_s
/// allow, or within a factor 1.25 of it.
std::vector<std::string> gain_warnings(const ArmParameters& arm, const ControllerSettings& settings,
                                       double theta_rad);

}  // namespace softarm
