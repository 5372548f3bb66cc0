// Four neighbouring segments side by side, one lane a segment: what does not depend on how their
// frames move is computed for all four at once.
#pragma once

#include <type_traits>

#include "model/arc_moments.hpp"
#include "model/dual.hpp"
#include "model/point_motion.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// Shape of four segments, each in its own S_{i-1}. L: Lanes, or with their tangents along the
/// segments' own coordinates.
template <class L>
struct ShapeLanesOf {
  using Lane = L;
  L ux, uy, c0;
  Lanes mass;
  CurveOf<L> tip, centre;
  SpinOf<L> turn_rate;
  ArcMomentsOf<L> arc;  ///< only where mass is distributed
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

/// The coordinate k of four segments: with tangents, the one along itself is 1.
template <class L>
inline L coordinate(const Lanes& value, std::size_t k) noexcept {
  L out(value);
  if constexpr (!std::is_same_v<L, Lanes>) out.d.along[k] = Lanes{1.0, 1.0, 1.0, 1.0};
  return out;
}

/// Fills everything but ux and uy, which the caller has set, for the segments from `begin` on,
/// whose coordinates are at q, and returns their lengths. Lanes beyond the last segment are straight
/// and weigh nothing.
template <bool kArc, bool kExtensible, class L>
inline auto set_shape(const ArmParameters& arm, int begin, const double* q,
                      ShapeLanesOf<L>& k) noexcept {
  static_assert(sizeof(SegmentParameters) % sizeof(double) == 0);
  constexpr int kStride = sizeof(SegmentParameters) / sizeof(double);
  const int count = arm.size() - begin;
  const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(begin)];
  std::conditional_t<kExtensible, L, Lanes> length = load(&segment.length_m, kStride, count);
  if constexpr (kExtensible) length += coordinate<L>(load(q + 2, 3, count), 2);
  const L s = k.ux * k.ux + k.uy * k.uy;
  const auto c = entire < kArc ? 12 : 8 > (s);
  k.mass = load(&segment.mass_kg, kStride, count);
  k.c0 = c[0];
  k.tip = tip_curve(length, c);
  k.centre = centre_curve(length, c);
  k.turn_rate = spin(c);
  if constexpr (kArc) k.arc = arc_moments(k.mass * length * length, s, c);
  return length;
}

/// Rates at v: those of u.
template <bool kExtensible, class L>
inline DirectionOf<L> load_direction(const double* v, int count,
                                     const ShapeLanesOf<L>& k) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  return direction(k.ux, k.uy, L(load(v, kWidth, count)), L(load(v + 1, kWidth, count)));
}
/// Rates at v: that of e over the length.
template <class L>
inline L load_strain_rate(const double* v, int count, const L& inverse_length) noexcept {
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
template <class L>
inline auto lane(const DirectionOf<L>& d, int l) noexcept {
  return DirectionOf<decltype(at(d.x, l))>{at(d.x, l), at(d.y, l), at(d.along, l)};
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

  DirectionOf<L> a, b;
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
  using L = typename Segments::Lane;
  constexpr int kWidth = kCoordinates<Segments::kExtensible>;
  const int count = arm.size() - begin;
  const double* const q = u + kWidth * begin;
  k.ux = coordinate<L>(load(q, kWidth, count), 0);
  k.uy = coordinate<L>(load(q + 1, kWidth, count), 1);
  const auto length = set_shape<kArc, Segments::kExtensible>(arm, begin, q, k);
  if constexpr (Segments::kExtensible) k.inverse_length = 1.0 / length;
}

}  // namespace softarm
