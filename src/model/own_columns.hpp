// What a segment's own mass contributes to its columns of B and C and to the body that its ancestors
// carry.
#pragma once

#include <array>

#include "model/arc_moments.hpp"
#include "model/composite.hpp"
#include "model/point_motion.hpp"

namespace softarm {

/// With J_e = dr/dq_e (e = x, y and the elongation, side by side) the motion of the own mass for
/// unit q_e', J_e' its rate in the world, r from the base p_{i-1} and r' its rate relative to the
/// base; integrals over the mass, in S_{i-1}.
template <bool kExtensible>
struct OwnColumns {
  using Column = Columns<kExtensible>;
  using Rows = std::array<Column, kCoordinates<kExtensible>>;

  Vec3<Column> momentum;       ///< int J_e
  Vec3<Column> angular;        ///< int r x J_e
  Vec3<Column> momentum_rate;  ///< int J_e'
  Vec3<Column> angular_rate;   ///< int r x J_e'
  Vec3<Column> flow;           ///< int r' x J_e
  Rows inertia;                ///< int J_e . J_f
  Rows coriolis;               ///< int J_e . J_f'
  PairVector3 first;           ///< {int r, int r'}
  Vec3<PairVector3> second;    ///< row i: {int r_i r, int r_i r'}
};

/// All mass in the centre: r = c. Without kRates the rates and what C needs are left as they are.
template <bool kRates, bool kExtensible>
[[gnu::always_inline]] inline OwnColumns<kExtensible> point_columns(
    double mass, const SegmentState<kExtensible>& state, const Curve& centre) noexcept {
  const auto c = point_motion(centre, state);
  OwnColumns<kExtensible> out;
  out.momentum = mass * c.J;
  out.angular = cross(c.place, out.momentum);
  if constexpr (kRates) {
    out.momentum_rate = mass * c.J_rate;
    out.angular_rate = cross(c.place, out.momentum_rate);
    out.flow = cross(c.rate, out.momentum);
  }
  const auto set_row = [&](std::size_t row, const Vector3& J) {
    out.inertia[row] = dot(J, out.momentum);
    if constexpr (kRates) out.coriolis[row] = dot(J, out.momentum_rate);
  };
  set_row(0, column(c.J, 0));
  set_row(1, column(c.J, 1));
  if constexpr (kExtensible) set_row(2, column(c.J, 2));
  out.first = mass * side_by_side(c.place, kRates ? c.rate : Vector3{0.0, 0.0, 0.0});
  out.second = {c.place.x * out.first, c.place.y * out.first, c.place.z * out.first};
  return out;
}

/// Second moments of the arc in place of products of its centre; first moments as for the point.
template <bool kRates, bool kExtensible>
OwnColumns<kExtensible> arc_columns(double mass, const SegmentState<kExtensible>& state,
                                    const Curve& centre, const ArcMoments& m) noexcept;

/// Adds what thin discs along the arc do that turn with it (rotary_inertia.hpp).
/// @param inertia mu r^2 / 4 of the whole segment, kg m^2.
template <bool kRates, bool kExtensible>
void add_discs(double inertia, const SegmentState<kExtensible>& state,
               OwnColumns<kExtensible>& own) noexcept;

}  // namespace softarm
