// What a segment's own mass contributes to its two columns of B and C and to the body that its
// ancestors carry.
#pragma once

#include "model/arc_moments.hpp"
#include "model/composite.hpp"

namespace softarm {

/// With J_e = dr/du_e (e = x, y side by side) the motion of the own mass for unit u_e', J_e' its
/// rate in the world, r from the base p_{i-1} and r' its rate relative to the base; integrals over
/// the mass, in S_{i-1}.
struct OwnColumns {
  PairVector3 momentum;         ///< int J_e
  PairVector3 angular;          ///< int r x J_e
  PairVector3 momentum_rate;    ///< int J_e'
  PairVector3 angular_rate;     ///< int r x J_e'
  PairVector3 flow;             ///< int r' x J_e
  Pair inertia_x, inertia_y;    ///< rows of int J_e . J_f
  Pair coriolis_x, coriolis_y;  ///< rows of int J_e . J_f'
  PairVector3 first;            ///< {int r, int r'}
  Vec3<PairVector3> second;     ///< row i: {int r_i r, int r_i r'}
};

/// State of one segment as its own mass sees it.
struct OwnState {
  double ux, uy, mass;
  Direction v;   ///< u'
  Vector3 spin;  ///< angular velocity of S_{i-1}, in S_{i-1}
};

/// All mass in the centre: r = c.
inline OwnColumns point_columns(const OwnState& state, const Curve& centre) noexcept {
  const double ux = state.ux, uy = state.uy, mass = state.mass;
  const Vector3 r = point(centre, ux, uy);
  const Vector3 r_rate = first(centre, ux, uy, state.v) + cross(state.spin, r);
  const PairVector3 J = columns(centre, ux, uy);
  const PairVector3 J_rate = column_rates(centre, ux, uy, state.v) + cross(state.spin, J);
  OwnColumns out;
  out.momentum = mass * J;
  out.angular = cross(r, out.momentum);
  out.momentum_rate = mass * J_rate;
  out.angular_rate = cross(r, out.momentum_rate);
  out.flow = cross(r_rate, out.momentum);
  out.inertia_x = dot(column(J, 0), out.momentum);
  out.inertia_y = dot(column(J, 1), out.momentum);
  out.coriolis_x = dot(column(J, 0), out.momentum_rate);
  out.coriolis_y = dot(column(J, 1), out.momentum_rate);
  out.first = mass * side_by_side(r, r_rate);
  out.second = {r.x * out.first, r.y * out.first, r.z * out.first};
  return out;
}

/// Second moments of the arc in place of products of its centre; first moments as for the point.
OwnColumns arc_columns(const OwnState& state, const Curve& centre, const ArcMoments& m) noexcept;

}  // namespace softarm
