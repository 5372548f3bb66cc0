// The closed loop of an experiment, linearized, with everything that samples, delays and filters in
// it: what a linear theory says of stability.
#pragma once

#include <Eigen/Core>

#include "softarm/config/experiment.hpp"

namespace softarm {

/// Growth rate (1/s) of the slowest small deviation from rest in `u_rad` (2n): negative where the
/// loop is stable. The rate is that of the leading Floquet multiplier, by power iteration on
///   the arm      B e'' + D e' + (K + G_u) e = f,
///   the valves   f' = (s - f) / lag, s the command that came into force dead_time ago, held,
///   the sensing  frames at mocap.rate_hz that arrive latency_s later,
///   the filter   of `estimation`, in its steady state, read half a control period ahead,
///   the control  -(K_P e + K_D e') + G_u e, once a control period.
/// Left out: saturation, slew, noise, what is not small. Control in u only.
/// @throws std::invalid_argument where u_rad does not fit the arm
double loop_growth_1ps(const Experiment& experiment, const Eigen::VectorXd& u_rad);

/// Largest factor on K_P and K_D with which the growth is negative, within 0.1 %; `upper` if none
/// up to it is too much, 0 if the loop without feedback is not stable.
double largest_sampled_factor(const Experiment& experiment, const Eigen::VectorXd& u_rad,
                              double upper = 100.0);

}  // namespace softarm
