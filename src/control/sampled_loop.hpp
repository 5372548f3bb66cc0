// One bending plane of the closed loop, linearized about the straight arm at rest, with everything
// that samples, delays and filters in it.
#pragma once

#include <Eigen/Core>

#include "softarm/control/gain_check.hpp"

namespace softarm {

/// One bending plane of an arm, linearized about the straight pose at rest; sizes n, N m, rad, s.
struct BendingPlane {
  Eigen::MatrixXd inverse_inertia, gravity_slope, stiffness, damping;
  Eigen::MatrixXd kp, kd;  ///< of the controller
};

/// The plane in the coordinates of its `modes` / 2 slowest and as many fastest modes, those of
/// (K + G_u) v = w^2 B v: slow ones lose stability to gravity, fast ones to sampling and delay. What
/// is left out lies between them. The cost of a loop goes with the square of the size.
BendingPlane reduced(const BendingPlane& plane, int modes);

/// Growth rate (1/s) of the slowest small deviation: negative where the loop is stable, infinite
/// where it overflows. The rate is that of the leading Floquet multiplier, by power iteration on
///   the arm      B e'' + D e' + (K + G_u) e = f,
///   the valves   f' = (s - f) / lag, s the command that came into force dead_time ago, held,
///   the sensing  a frame every frame_period,
///   the filter   of third order, in its steady state, read half a control period ahead,
///   the control  s = -(K_P e + K_D e') + G_u e where gravity is fed back, every control_period.
/// Left out: saturation, slew, noise, what is not small. Times are rounded to an eighth of the
/// control period. Not for the loop: allocates.
/// @param factor  on K_P and K_D
double loop_growth_1ps(const BendingPlane& plane, const LoopSampling& sampling, double factor,
                       bool gravity_fed_back);

}  // namespace softarm
