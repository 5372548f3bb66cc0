// The model once more, slowly, in 80-bit long double and by other means: what the tests and
// `softarm-dev bench model` hold the direct route against.
//
// Every mass is a point here. The columns of its Jacobian are omega x (c - p_j) + R dt/du, their
// rates come from dual numbers, and B = sum mu J'J, C = sum mu J' J-dot, G = -sum mu J' g are taken
// literally. Distributed mass is a Gauss-Legendre rule along the arc, the rotary inertia of a thin
// disc four points on a ring of radius r / sqrt 2 around each node. The entire functions are plain
// sums of their series. Coordinates are u, or [u_x, u_y, e] where the arm stretches: 2n below is
// then 3n. `to_polar` applies the chain rule. All of it is good to about 1e-17 relative to the
// scales below for theta up to 8, and allocates as it pleases.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "softarm/model/arm.hpp"

namespace softarm::reference {

using Real = long double;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using Matrix3X = Eigen::Matrix<Real, 3, Eigen::Dynamic>;
using Matrix3 = Eigen::Matrix<Real, 3, 3>;
using Vector3 = Eigen::Matrix<Real, 3, 1>;

/// c_0(s) ... c_11(s).
std::array<Real, 12> entire_functions(Real s);

struct Kinematics {
  std::vector<Matrix3> rotations;    ///< of every segment's end, in the world
  std::vector<Vector3> positions;    ///< of every segment's end, in the world, in m
  Matrix3X centres;                  ///< 3 x n, of mass, in the world, in m
  Matrix3X jacobian, jacobian_rate;  ///< of the tip and its rate along the velocity, 3 x 2n, m/rad
  Matrix3X angular_jacobian;         ///< angular velocity of S_n in the world for unit u', 3 x 2n
};

/// @param u, velocity 2n.
Kinematics kinematics(const ArmParameters& arm, const Vector& u, const Vector& velocity);

/// The terms of (16) and the sizes that their rounding errors are measured by. By Cauchy's
/// inequality |B_ij| <= s_i s_j, |C_ij| <= s_i r_j and |G_i| <= s_i w: what is small against these
/// is a sum of masses' contributions that cancel.
struct Dynamics {
  Matrix B, C;
  Vector G;
  Vector s;                                        ///< s_i = sqrt(sum mu |J_i|^2) = sqrt(B_ii)
  Vector r;                                        ///< r_j = sqrt(sum mu |J_j-dot|^2)
  Real w = 0;                                      ///< sqrt(sum mu) |g|
  Real kinetic_energy = 0, gravity_potential = 0;  ///< J
  Real potential_scale = 0;                        ///< sum mu |g| (|p0| + arc length to the end), J
};

/// B, C, G and the energies in u.
/// @param velocity 2n, the one C and the kinetic energy are for.
/// @param extra_nodes more than the rule needs, to see that it needs no more.
Dynamics dynamics(const ArmParameters& arm, const Vector& u, const Vector& velocity,
                  int extra_nodes = 0);

/// B x + C b + G with C of the velocity that `terms` were evaluated for.
Vector inverse_dynamics(const Dynamics& terms, const Vector& b, const Vector& x);

/// What each row's rounding error is measured by: s_i (sum s_j |x_j| + sum r_j |b_j| + w).
Vector inverse_dynamics_scale(const Dynamics& terms, const Vector& b, const Vector& x);

/// K u + D u' of (14).
Vector impedance(const ArmParameters& arm, const Vector& u, const Vector& velocity);

/// u'' of (16) by Cholesky with diagonal scaling; NaN where B is not positive definite.
Vector forward_dynamics(const ArmParameters& arm, const Dynamics& terms, const Vector& u,
                        const Vector& velocity, const Vector& generalized_force);

/// Polar coordinates q = [phi, theta] of every segment to u, q' to u'.
Vector polar_to_u(const Vector& q);
Vector polar_velocity_to_u(const Vector& q, const Vector& velocity);

/// The same terms in polar coordinates, by u' = P q': P'BP, P'(B P-dot + C P), P'G. The scales
/// follow: s_i of J P, r_j of d/dt (J P), bounded by the triangle inequality.
Dynamics to_polar(const Dynamics& terms, const Vector& q, const Vector& velocity);

/// Gauss-Legendre on [0, 1].
struct Quadrature {
  std::vector<Real> node, weight;
};
const Quadrature& gauss_legendre(int order);

}  // namespace softarm::reference
