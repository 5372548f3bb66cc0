// Do the configured gains leave the loop stable, given its delay and the valves' lag?
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "softarm/control/settings.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// What samples, delays and filters between the motion of the arm and the moments on it.
struct LoopSampling {
  double control_period_s = 0.002;
  double frame_period_s = 0.005;
  double frame_latency_s = 0.0;  ///< from capture to arrival
  double filter_bandwidth_radps = 30.0;
  double dead_time_s = 0.0;  ///< of valves and tubes
  double valve_lag_s = 0.0;  ///< first order
};

/// Growth rate (1/s) of the slowest small deviation from the straight pose at rest under feedback
/// by kp_u (N m/rad) and kd_u (N m s/rad), diagonals in u, 2n each: negative where the loop is
/// stable. gravity_fed_back: the controller takes G(u) away, as (17) does, as late as all else.
/// Linearized, planes do not couple, frames and ticks on a common grid; otherwise exact: sampling,
/// hold, delays, lag and the velocity filter are in it. Not in it: saturation, slew, noise, a bent
/// arm, `ki`. Not for the loop: allocates, and simulates 13 s.
/// @throws std::invalid_argument where sizes do not fit
double loop_growth_1ps(const ArmParameters& arm, const LoopSampling& sampling,
                       const Eigen::VectorXd& kp_u, const Eigen::VectorXd& kd_u,
                       bool gravity_fed_back);

/// Largest factor on the gains with which that growth is negative, within 0.1 %; 0 if the loop is
/// unstable without them, at most 1e3.
double largest_gain_factor(const ArmParameters& arm, const LoopSampling& sampling,
                           const Eigen::VectorXd& kp_u, const Eigen::VectorXd& kd_u,
                           bool gravity_fed_back);

/// Compliance of the tip (m/N, world frame) against a small constant force on an arm at rest in u:
///   J (K + K_P + G_u)^-1 J'.
/// gravity_fed_back: the controller's G(u) takes G_u away, as (17) does; K_P = 0 and false is the
/// passive arm under constant torques. kp_u: diagonal, 2n.
/// @throws std::invalid_argument where sizes do not fit
Eigen::Matrix3d tip_compliance(const ArmParameters& arm, const Eigen::VectorXd& u,
                               const Eigen::VectorXd& kp_u, bool gravity_fed_back);

/// Texts for a person, none if all is well: gains (in polar coordinates K_P,phi / theta^2 at
/// `theta_rad`, the largest theta that the reference reaches) above what the loop leaves stable, or
/// within a factor 1.25 of it.
std::vector<std::string> gain_warnings(const ArmParameters& arm, const ControllerSettings& settings,
                                       const LoopSampling& sampling, double theta_rad);

}  // namespace softarm
