// Four neighbouring segments side by side, one lane a segment: what does not depend on how their
// frames move is computed for all four at once.
#pragma once

#include <type_traits>

#include "model/arc_moments.hpp"
#include "model/dual.hpp"
#include "model/point_motion.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// What a segment's shape has of s = u . u and its length.
template <class L>
struct ShapeFunctionsOf {
  L c0;
  CurveOf<L> tip, centre;
  SpinOf<L> turn_rate;
  ArcMomentsOf<L> arc;  ///< only where mass is distributed
};

/// Shape of four segments, each in its own S_{i-1}; or of one, L then being a number with its
/// tangents along the segment's own coordinates.
template <class L>
struct ShapeLanesOf : ShapeFunctionsOf<L> {
  using Lane = L;
  L ux, uy;
  PlainOf<L> mass;
};
using ShapeLanes = ShapeLanesOf<Lanes>;

/// Segment i is this lane of this group of four. Unsigned: half the instructions.
inline int lane_of(int i) noexcept { return static_cast<int>(static_cast<unsigned>(i) % kLanes); }
inline unsigned group_of(int i) noexcept { return static_cast<unsigned>(i) / kLanes; }

/// v[0], v[stride], ... for `count` lanes, 0 beyond.
inline Lanes load(const double* v, int stride, int count) noexcept {
  return Lanes{v[0], count > 1 ? v[stride] : 0.0, count > 2 ? v[2 * stride] : 0.0,
               count > 3 ? v[3 * stride] : 0.0};
}

/// Of the segments from `begin` on, whose coordinates are at q. Lanes beyond the last segment weigh
/// nothing.
struct LengthsAndMasses {
  Lanes length, mass;

  template <bool kExtensible>
  static LengthsAndMasses load_from(const ArmParameters& arm, int begin, const double* q) noexcept {
    static_assert(sizeof(SegmentParameters) % sizeof(double) == 0);
    constexpr int kStride = sizeof(SegmentParameters) / sizeof(double);
    const int count = arm.size() - begin;
    const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(begin)];
    Lanes length = load(&segment.length_m, kStride, count);
    if constexpr (kExtensible) length += load(q + 2, 3, count);
    return {length, load(&segment.mass_kg, kStride, count)};
  }
};

template <bool kArc, class L>
inline void set_functions(const LengthsAndMasses& of, const L& s, ShapeFunctionsOf<L>& k) noexcept {
  const auto c = entire < kArc ? 12 : 8 > (s);
  k.c0 = c[0];
  k.tip = tip_curve(of.length, c);
  k.centre = centre_curve(of.length, c);
  k.turn_rate = spin(c);
  if constexpr (kArc) k.arc = arc_moments(of.mass * of.length * of.length, s, c);
}

/// Fills everything but ux and uy, which the caller has set, for the segments from `begin` on,
/// whose coordinates are at q, and returns their lengths. Lanes beyond the last segment are straight
/// and weigh nothing.
template <bool kArc, bool kExtensible>
inline Lanes set_shape(const ArmParameters& arm, int begin, const double* q,
                       ShapeLanes& k) noexcept {
  const auto of = LengthsAndMasses::load_from<kExtensible>(arm, begin, q);
  k.mass = of.mass;
  set_functions<kArc>(of, k.ux * k.ux + k.uy * k.uy, k);
  return of.length;
}

/// Rates at v: those of u.
template <bool kExtensible>
inline DirectionOf<Lanes> load_direction(const double* v, int count, const ShapeLanes& k) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  return direction(k.ux, k.uy, load(v, kWidth, count), load(v + 1, kWidth, count));
}
/// Rates at v: that of e over the length.
inline Lanes load_strain_rate(const double* v, int count, const Lanes& inverse_length) noexcept {
  return load(v + 2, 3, count) * inverse_length;
}

template <class L>
inline auto turn(const ShapeLanesOf<L>& k, int l) noexcept {
  return TurnOf<decltype(at(k.ux, l))>{at(k.ux, l), at(k.uy, l), at(k.c0, l), at(k.turn_rate.c1, l),
                                       at(k.turn_rate.c2, l)};
}
template <class L>
inline auto lane(const Vec3<L>& v, int l) noexcept {
  return Vec3<decltype(at(v.x, l))>{at(v.x, l), at(v.y, l), at(v.z, l)};
}
inline Curve lane(const CurveOf<Lanes>& f, int l) noexcept {
  return {f.p[l], f.q[l], f.p1[l], f.q1[l], f.p2[l], f.q2[l]};
}
template <class L, class Component>
inline auto lane(const DirectionOf<L, Component>& d, int l) noexcept {
  return DirectionOf<decltype(at(d.along, l)), decltype(at(d.x, l))>{at(d.x, l), at(d.y, l),
                                                                     at(d.along, l)};
}
inline Spin lane(const SpinOf<Lanes>& w, int l) noexcept {
  return {w.c1[l], w.c2[l], w.c3[l], w.mixed[l], w.c3_1[l], w.c2_1[l]};
}

template <class L>
inline auto lane(const ArcMomentsOf<L>& m, int l) noexcept {
  return ArcMomentsOf<decltype(at(m.pp, l))>{
      at(m.pp, l),  at(m.pq, l),   at(m.qq, l),   at(m.pp1, l),  at(m.pq1, l),
      at(m.qp1, l), at(m.qq1, l),  at(m.pp2, l),  at(m.pq2, l),  at(m.qp2, l),
      at(m.qq2, l), at(m.p1p1, l), at(m.q1q1, l), at(m.p1p2, l), at(m.q1q2, l)};
}

/// What inverse_dynamics adds: motion within S_{i-1}, twice along a and b and once along x.
template <class L>
struct SegmentLanesOf : ShapeLanesOf<L> {
  static constexpr bool kExtensible = false;

  DirectionOf<L, PlainOf<L>> a, b;
  Vec3<L> spin_a, spin_b;  ///< angular velocity of S_i relative to S_{i-1} along a, b
  Vec3<L> own_tip, own_centre, own_spin;  ///< accelerations, the last one angular
  /// Distributed mass: integrals of P, Q and (P1 u, Q1) times the acceleration.
  Vec3<L> own_p, own_q;
  L own_stretch;
};

/// Where segments stretch: 1 / l, and e' / l along a and b.
template <class L>
struct ExtensibleLanesOf : SegmentLanesOf<L> {
  static constexpr bool kExtensible = true;

  L inverse_length, strain_a, strain_b;
};
template <bool kExtensible, class L>
using LanesOf = std::conditional_t<kExtensible, ExtensibleLanesOf<L>, SegmentLanesOf<L>>;

/// Shape of the segments from `begin` on: u is that of the whole arm.
template <bool kArc, class Segments>
inline void load_shape(const ArmParameters& arm, int begin, const double* u, Segments& k) noexcept {
  constexpr int kWidth = kCoordinates<Segments::kExtensible>;
  const int count = arm.size() - begin;
  const double* const q = u + kWidth * begin;
  k.ux = load(q, kWidth, count);
  k.uy = load(q + 1, kWidth, count);
  const Lanes length = set_shape<kArc, Segments::kExtensible>(arm, begin, q, k);
  if constexpr (Segments::kExtensible) k.inverse_length = 1.0 / length;
}

}  // namespace softarm
