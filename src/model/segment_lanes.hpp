// Four neighbouring segments side by side, one lane a segment: what does not depend on how their
// frames move is computed for all four at once.
#pragma once

#include "model/arc_moments.hpp"
#include "model/point_motion.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// Shape of four segments, each in its own S_{i-1}.
struct ShapeLanes {
  Lanes ux, uy, c0;
  Lanes mass;
  CurveOf<Lanes> tip, centre;
  SpinOf<Lanes> turn_rate;
  ArcMomentsOf<Lanes> arc;  ///< only where mass is distributed
};

/// Segment i is this lane of this group of four. Unsigned: half the instructions.
inline int lane_of(int i) noexcept { return static_cast<int>(static_cast<unsigned>(i) % kLanes); }
inline unsigned group_of(int i) noexcept { return static_cast<unsigned>(i) / kLanes; }

/// v[0], v[stride], ... for `count` lanes, 0 beyond.
inline Lanes load(const double* v, int stride, int count) noexcept {
  return Lanes{v[0], count > 1 ? v[stride] : 0.0, count > 2 ? v[2 * stride] : 0.0,
               count > 3 ? v[3 * stride] : 0.0};
}

/// Fills everything but ux and uy, which the caller has set, for the segments from `begin` on,
/// whose coordinates are at q, and returns their lengths. Lanes beyond the last segment are straight
/// and weigh nothing.
template <bool kArc, bool kExtensible>
inline Lanes set_shape(const ArmParameters& arm, int begin, const double* q,
                       ShapeLanes& k) noexcept {
  static_assert(sizeof(SegmentParameters) % sizeof(double) == 0);
  constexpr int kStride = sizeof(SegmentParameters) / sizeof(double);
  const int count = arm.size() - begin;
  const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(begin)];
  Lanes length = load(&segment.length_m, kStride, count);
  if constexpr (kExtensible) length += load(q + 2, 3, count);
  const Lanes s = k.ux * k.ux + k.uy * k.uy;
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
template <bool kExtensible>
inline DirectionOf<Lanes> load_direction(const double* v, int count, const ShapeLanes& k) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  return direction(k.ux, k.uy, load(v, kWidth, count), load(v + 1, kWidth, count));
}
/// Rates at v: that of e over the length.
inline Lanes load_strain_rate(const double* v, int count, const Lanes& inverse_length) noexcept {
  return load(v + 2, 3, count) * inverse_length;
}

inline Turn turn(const ShapeLanes& k, int l) noexcept {
  return {k.ux[l], k.uy[l], k.c0[l], k.turn_rate.c1[l], k.turn_rate.c2[l]};
}
inline Curve lane(const CurveOf<Lanes>& f, int l) noexcept {
  return {f.p[l], f.q[l], f.p1[l], f.q1[l], f.p2[l], f.q2[l]};
}
inline Direction lane(const DirectionOf<Lanes>& d, int l) noexcept {
  return {d.x[l], d.y[l], d.along[l]};
}
inline Spin lane(const SpinOf<Lanes>& w, int l) noexcept {
  return {w.c1[l], w.c2[l], w.c3[l], w.mixed[l], w.c3_1[l], w.c2_1[l]};
}

inline ArcMoments lane(const ArcMomentsOf<Lanes>& m, int l) noexcept {
  return {m.pp[l],  m.pq[l],  m.qq[l],  m.pp1[l],  m.pq1[l],  m.qp1[l],  m.qq1[l], m.pp2[l],
          m.pq2[l], m.qp2[l], m.qq2[l], m.p1p1[l], m.q1q1[l], m.p1p2[l], m.q1q2[l]};
}

/// What inverse_dynamics adds: motion within S_{i-1}, twice along a and b and once along x.
struct SegmentLanes : ShapeLanes {
  static constexpr bool kExtensible = false;

  DirectionOf<Lanes> a, b;
  Vec3<Lanes> spin_a, spin_b;  ///< angular velocity of S_i relative to S_{i-1} along a, b
  Vec3<Lanes> own_tip, own_centre, own_spin;  ///< accelerations, the last one angular
  /// Distributed mass: integrals of P, Q and (P1 u, Q1) times the acceleration.
  Vec3<Lanes> own_p, own_q;
  Lanes own_stretch;
};

/// Where segments stretch: 1 / l, and e' / l along a and b.
struct ExtensibleLanes : SegmentLanes {
  static constexpr bool kExtensible = true;

  Lanes inverse_length, strain_a, strain_b;
};

}  // namespace softarm
