// Second moments of a homogeneous arc: what distributed mass needs and a point mass does not.
//
// A point at arc fraction x is r(x) = L (P u, Q) with P(x) = x^2 c2(x^2 s), Q(x) = x c1(x^2 s). Its
// derivatives by u bring P1 = 2 dP/ds, Q1 = 2 dQ/ds and P2 = 2 dP1/ds, Q2 = 2 dQ1/ds. All integrals
// over the arc of products of two of them are in closed form; nothing is sampled.
#pragma once

#include <array>

#include "model/dual.hpp"
#include "model/segment_geometry.hpp"

namespace softarm {

/// mu L^2 times the integral over x in [0, 1] of the product that the name says, in kg m^2.
template <class T>
struct ArcMomentsOf {
  T pp, pq, qq;
  T pp1, pq1, qp1, qq1;
  T pp2, pq2, qp2, qq2;
  T p1p1, q1q1, p1p2, q1q2;

  /// Integral of r . dr/du_e over u_e, half the rate of the trace of the second moment.
  T trace_rate(T s) const noexcept { return pp + s * pp1 + qq1; }
};
using ArcMoments = ArcMomentsOf<double>;

/// Below this s the moments are sums of c_k(4s) and c_k(s); above, of moments of sines and cosines,
/// since there the sums cancel (and below, those do). Both sides are within 10 ulp of their share
/// in B and C at the switch.
inline constexpr double kArcSeriesLimit = 4.0;

/// @param c c_0(s) ... c_11(s), of which only c_0 and c_1 are read above the limit.
ArcMoments arc_moments(double mass_length_squared, double s,
                       const std::array<double, 12>& c) noexcept;

/// The same of four segments. A lane's numbers do not depend on its neighbours.
ArcMomentsOf<Lanes> arc_moments(const Lanes& mass_length_squared, const Lanes& s,
                                const std::array<Lanes, 12>& c) noexcept;

/// With their derivatives by what s depends on.
ArcMomentsOf<SlopeLanes> arc_moments(const Lanes& mass_length_squared, const SlopeLanes& s,
                                     const std::array<SlopeLanes, 12>& c) noexcept;

}  // namespace softarm
