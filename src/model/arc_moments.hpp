// Second moments of a homogeneous arc: what distributed mass needs and a point mass does not.
//
// A point at arc fraction x is r(x) = L (P u, Q) with P(x) = x^2 c2(x^2 s), Q(x) = x c1(x^2 s). Its
// derivatives by u bring P1 = 2 dP/ds, Q1 = 2 dQ/ds and P2 = 2 dP1/ds, Q2 = 2 dQ1/ds. All integrals
// over the arc of products of two of them are in closed form; nothing is sampled.
#pragma once

#include "model/segment_geometry.hpp"

namespace softarm {

/// mu L^2 times the integral over x in [0, 1] of the product that the name says, in kg m^2.
struct ArcMoments {
  double pp, pq, qq;
  double pp1, pq1, qp1, qq1;
  double pp2, pq2, qp2, qq2;
  double p1p1, q1q1, p1p2, q1q2;

  /// Integral of r . dr/du_e over u_e, half the rate of the trace of the second moment.
  double trace_rate(double s) const noexcept { return pp + s * pp1 + qq1; }
};

/// Below this s the moments are sums of c_k(4s) and c_k(s); above, of moments of sines and cosines,
/// since there the sums cancel (and below, those do). Both sides are within 10 ulp of their share
/// in B and C at the switch.
inline constexpr double kArcSeriesLimit = 4.0;

/// @param c c_0(s) ... c_11(s), of which only c_0 and c_1 are read above the limit.
ArcMoments arc_moments(double mass_length_squared, double s,
                       const std::array<double, 12>& c) noexcept;

/// What the segment's frame and the directions of the recursion do to its own mass, beyond the
/// acceleration of its base: integrals of r x acceleration (about the base) and of dr/du .
/// acceleration, times mu. All in S_{i-1}.
struct ArcForces {
  Vector3 moment;
  Pair torque;
};

/// (u x e) for both columns e: the vector J u.
inline Pair turned(double ux, double uy) noexcept { return Pair{-uy, ux}; }

/// Integral of r x (angular x r) + r x w and dr/du . the same, where w = P x + P1 g + P2 kappa u in
/// the plane and Q1 beta + Q2 kappa along z is the arc's acceleration within its frame (directions
/// a, b twice and x once).
struct ArcMotion {
  double x, y;         ///< x
  double g_x, g_y;     ///< (u.b) a + (u.a) b + beta u
  double beta, kappa;  ///< a.b + u.x and (u.a)(u.b)
  double along;        ///< u.x
};

inline ArcForces relative_motion_forces(const ArcMoments& m, double ux, double uy, double s,
                                        const ArcMotion& w) noexcept {
  const double z = m.pq1 * w.beta + m.pq2 * w.kappa - m.qp2 * w.kappa;
  const double in_x = m.pq * w.x + m.qp1 * w.g_x - z * ux;
  const double in_y = m.pq * w.y + m.qp1 * w.g_y - z * uy;
  const double plane_x = m.pp * w.x + m.pp1 * w.g_x;
  const double plane_y = m.pp * w.y + m.pp1 * w.g_y;
  const double stretch = m.pp2 * w.kappa + m.pp1 * w.along + m.p1p1 * (2.0 * w.kappa + w.beta * s) +
                         m.p1p2 * w.kappa * s + m.q1q1 * w.beta + m.q1q2 * w.kappa;
  return {{-in_y, in_x, ux * plane_y - uy * plane_x},
          Pair{plane_x + stretch * ux, plane_y + stretch * uy}};
}

/// The second moment W = integral of r r^T applied to v.
inline Vector3 second_moment_times(const ArcMoments& m, double ux, double uy,
                                   const Vector3& v) noexcept {
  const double along = ux * v.x + uy * v.y;
  const double plane = m.pp * along + m.pq * v.z;
  return {plane * ux, plane * uy, m.pq * along + m.qq * v.z};
}

/// Angular acceleration of the frame.
inline ArcForces angular_forces(const ArcMoments& m, double ux, double uy, double s,
                                const Vector3& angular) noexcept {
  const Vector3 moved = second_moment_times(m, ux, uy, angular);
  const double trace = m.pp * s + m.qq;
  const double bend = (m.qp1 - m.pq1) * (ux * angular.y - uy * angular.x);
  const double twist = m.pp * angular.z;
  return {trace * angular - moved, Pair{m.pq * angular.y + bend * ux - twist * uy,
                                        -m.pq * angular.x + bend * uy + twist * ux}};
}

/// Centripetal acceleration ([w_a]x [w_b]x + [w_b]x [w_a]x) r / 2.
inline ArcForces centripetal_forces(const ArcMoments& m, double ux, double uy, double s,
                                    const Vector3& a, const Vector3& b, double ab) noexcept {
  const Vector3 moment = 0.5 * (cross(second_moment_times(m, ux, uy, b), a) +
                                cross(second_moment_times(m, ux, uy, a), b));
  const double a_u = ux * a.x + uy * a.y, b_u = ux * b.x + uy * b.y;
  const double plane_a = 0.5 * (m.pp * a_u + m.pq * a.z);
  const double plane_b = 0.5 * (m.pp * b_u + m.pq * b.z);
  const double stretch = m.pp1 * a_u * b_u + 0.5 * (m.qp1 + m.pq1) * (a_u * b.z + a.z * b_u) +
                         m.qq1 * a.z * b.z - ab * m.trace_rate(s);
  return {moment, Pair{plane_b * a.x + plane_a * b.x + stretch * ux,
                       plane_b * a.y + plane_a * b.y + stretch * uy}};
}

/// Coriolis acceleration spin x (dr along b).
inline ArcForces coriolis_forces(const ArcMoments& m, double ux, double uy, double s,
                                 const Vector3& spin, const Direction& b) noexcept {
  const double spin_u = ux * spin.x + uy * spin.y;
  const double plane = m.pp * spin_u + m.pq * spin.z;
  const double stretch = b.along * (m.pp1 * spin_u + m.qp1 * spin.z);
  const double radial = b.along * m.trace_rate(s);
  const Vector3 moment{radial * spin.x - plane * b.x - stretch * ux,
                       radial * spin.y - plane * b.y - stretch * uy,
                       radial * spin.z - b.along * (m.pq1 * spin_u + m.qq1 * spin.z)};
  const double bend = m.pq1 * b.along;
  const double twist = m.pp * spin.z;
  const double twist_u = m.pp1 * spin.z * b.along;
  const double along_u =
      -m.pq1 * (b.x * spin.y - b.y * spin.x) - m.pp1 * spin.z * (ux * b.y - uy * b.x);
  return {moment, Pair{bend * spin.y - twist * b.y - twist_u * uy + along_u * ux,
                       -bend * spin.x + twist * b.x + twist_u * ux + along_u * uy}};
}

}  // namespace softarm
