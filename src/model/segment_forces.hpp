// What one segment does in its own frame S_{i-1} with that frame's motion given: the steps of the
// Newton-Euler recursion (inverse_dynamics.cpp). Numbers are doubles, or duals of the segment's own
// coordinates (derivatives.cpp).
#pragma once

#include <type_traits>
#include <utility>

#include "model/dynamics_storage.hpp"
#include "model/rotary_inertia.hpp"

// In line at all of its places, for the base and for a moving frame: g++ would leave one a call.
#define SOFTARM_INLINE [[gnu::always_inline]] inline

namespace softarm::recursion {

/// Inputs of inverse_dynamics, 2n numbers each, 3n where segments stretch.
struct Inputs {
  const double* u;
  const double* a;
  const double* b;
  const double* x;
};

/// Derivative along x, and twice along a and b.
template <bool kFirst, bool kSecond, class Coefficients, class Segments, class X>
auto own(const Coefficients& f, const Segments& k, const X& x) noexcept {
  if constexpr (kFirst && kSecond) {
    return second(f, k.ux, k.uy, k.a, k.b) + first(f, k.ux, k.uy, x);
  } else if constexpr (kSecond) {
    return second(f, k.ux, k.uy, k.a, k.b);
  } else {
    return first(f, k.ux, k.uy, x);
  }
}

/// The arc's acceleration within its frame is P x + P1 g + P2 kappa u in the plane and Q1 beta + Q2
/// kappa along z.
template <class L, class X>
SOFTARM_INLINE void own_arc(const X& x, SegmentLanesOf<L>& k) noexcept {
  const auto& m = k.arc;
  const L ux = k.ux, uy = k.uy, s = ux * ux + uy * uy;
  const L beta = k.a.x * k.b.x + k.a.y * k.b.y + x.along;
  const L kappa = k.a.along * k.b.along;
  const L g_x = k.b.along * k.a.x + k.a.along * k.b.x + beta * ux;
  const L g_y = k.b.along * k.a.y + k.a.along * k.b.y + beta * uy;
  const L on_p = m.pp2 * kappa, on_q = m.qp2 * kappa;
  k.own_p = {m.pp * x.x + m.pp1 * g_x + on_p * ux, m.pp * x.y + m.pp1 * g_y + on_p * uy,
             m.pq1 * beta + m.pq2 * kappa};
  k.own_q = {m.pq * x.x + m.qp1 * g_x + on_q * ux, m.pq * x.y + m.qp1 * g_y + on_q * uy,
             m.qq1 * beta + m.qq2 * kappa};
  // u . g = 2 kappa + beta s
  k.own_stretch = m.pp1 * x.along + m.p1p1 * (2.0 * kappa + beta * s) + m.p1p2 * kappa * s +
                  m.q1q1 * beta + m.q1q2 * kappa;
}

/// Adds e_x r to what points do within the segment's frame.
template <bool kArc, class L>
void add_strain(const L& strain_x, ExtensibleLanesOf<L>& k) noexcept {
  k.own_tip += strain_x * point(k.tip, k.ux, k.uy);
  k.own_centre += strain_x * point(k.centre, k.ux, k.uy);
  if constexpr (!kArc) return;
  const auto& m = k.arc;
  const L on_p = strain_x * m.pp, on_q = strain_x * m.pq;
  k.own_p += Vec3<L>{on_p * k.ux, on_p * k.uy, on_q};
  k.own_q += Vec3<L>{on_q * k.ux, on_q * k.uy, strain_x * m.qq};
  k.own_stretch += strain_x * (m.pp1 * (k.ux * k.ux + k.uy * k.uy) + m.qq1);
}

/// What segments of known shape do within their frames. `number(v, k)` is their coordinate k in v, an
/// input of the whole arm.
template <MassModel kMass, bool kInertia, bool kCoriolis, class Segments, class Number>
SOFTARM_INLINE void set_own_motion(const Inputs& in, const Number& number, Segments& k) noexcept {
  using L = typename Segments::Lane;
  constexpr bool kExtensible = Segments::kExtensible;
  constexpr bool kArc = kMass == MassModel::distributed && (kInertia || kCoriolis);
  constexpr bool kFirst = kInertia || (kExtensible && kCoriolis);
  const auto along = [&](const double* v) {
    return direction(k.ux, k.uy, number(v, 0), number(v, 1));
  };
  DirectionOf<L, PlainOf<L>> x{};
  if constexpr (kInertia) x = along(in.x);
  if constexpr (kCoriolis) {
    k.a = along(in.a);
    k.b = along(in.b);
    k.spin_a = first(k.turn_rate, k.ux, k.uy, k.a);
    k.spin_b = first(k.turn_rate, k.ux, k.uy, k.b);
  } else if constexpr (kArc) {
    k.a = k.b = DirectionOf<L, PlainOf<L>>{};
  }
  // x + e_b a + e_a b: of what has a length
  std::conditional_t<kExtensible, DirectionOf<L>, DirectionOf<L, PlainOf<L>>> grown{x.x, x.y,
                                                                                    x.along};
  if constexpr (kExtensible && kCoriolis) {
    k.strain_a = number(in.a, 2) * k.inverse_length;
    k.strain_b = number(in.b, 2) * k.inverse_length;
    grown.x += k.strain_b * k.a.x + k.strain_a * k.b.x;
    grown.y += k.strain_b * k.a.y + k.strain_a * k.b.y;
    grown.along += k.strain_b * k.a.along + k.strain_a * k.b.along;
  }
  if constexpr (kInertia || kCoriolis) {
    k.own_tip = own<kFirst, kCoriolis>(k.tip, k, grown);
    k.own_centre = own<kFirst, kCoriolis>(k.centre, k, grown);
    k.own_spin = own<kInertia, kCoriolis>(k.turn_rate, k, x);
  }
  if constexpr (kArc) own_arc(grown, k);
  if constexpr (kExtensible && kInertia) {
    add_strain<kArc>(number(in.x, 2) * k.inverse_length, k);
  }
}

/// What segments `begin` ... `begin + 3` do within their own frames; lanes beyond the last segment
/// are straight and weigh nothing.
template <MassModel kMass, bool kInertia, bool kCoriolis, class Segments>
void prepare(const ArmParameters& arm, const Inputs& in, int begin, Segments& k) noexcept {
  constexpr bool kArc = kMass == MassModel::distributed && (kInertia || kCoriolis);
  constexpr int kWidth = kCoordinates<Segments::kExtensible>;
  const int count = arm.size() - begin;
  load_shape<kArc>(arm, begin, in.u, k);
  const int first_of = kWidth * begin;
  const auto number = [=](const double* v, int e) { return load(v + first_of + e, kWidth, count); };
  set_own_motion<kMass, kInertia, kCoriolis>(in, number, k);
}

/// Motion of the frame S_{i-1}, in its own coordinates.
template <class S>
struct FrameMotionOf {
  Vec3<S> spin_a, spin_b;   ///< angular velocity along a, b
  Vec3<S> angular, linear;  ///< alpha and D_a D_b p - g, what x does included
};

/// The acceleration of a point (P u, Q) of the segment, beyond that of p_{i-1} and its own within
/// S_{i-1}: P on_p + Q on_q + P1 on_p1 + Q1 on_q1.
template <class S>
struct FrameAccelerationOf {
  Vec3<S> on_p, on_q, on_p1, on_q1;
};
/// The same of the base, which neither turns nor moves: nothing.
struct StillFrame {};

template <bool kCoriolis, class Segments, class S>
SOFTARM_INLINE auto frame_acceleration(const FrameMotionOf<S>& m, const Segments& k,
                                       int l) noexcept {
  const auto ux = at(k.ux, l), uy = at(k.uy, l);
  using R = std::remove_cv_t<decltype(m.angular.x * ux)>;
  using Out = FrameAccelerationOf<R>;
  Vec3<R> al{m.angular.x, m.angular.y, m.angular.z};
  if constexpr (Segments::kExtensible && kCoriolis) {
    al += at(k.strain_b, l) * m.spin_a + at(k.strain_a, l) * m.spin_b;
  }
  if constexpr (!kCoriolis) {
    return Out{{al.z * -uy, al.z * ux, al.x * uy - al.y * ux}, {al.y, -al.x, 0.0}, {}, {}};
  }
  const auto &a = m.spin_a, &b = m.spin_b;
  const auto xx = a.x * b.x, yy = a.y * b.y, zz = a.z * b.z;
  const auto xy = 0.5 * (a.x * b.y + a.y * b.x);
  const auto xz = 0.5 * (a.x * b.z + a.z * b.x);
  const auto yz = 0.5 * (a.y * b.z + a.z * b.y);
  const auto ax = at(k.a.x, l), ay = at(k.a.y, l), bx = at(k.b.x, l), by = at(k.b.y, l);
  const auto sweep = at(k.b.along, l) * a + at(k.a.along, l) * b;
  return Out{// M (u, 0) + w_a x b + w_b x a
             {xy * uy - (yy + zz) * ux - al.z * uy - (a.z * by + b.z * ay),
              xy * ux - (xx + zz) * uy + al.z * ux + (a.z * bx + b.z * ax),
              (xz - al.y) * ux + (yz + al.x) * uy + (a.x * by - a.y * bx) + (b.x * ay - b.y * ax)},
             // M z
             {xz + al.y, yz - al.x, -(xx + yy)},
             // ((u.b) w_a + (u.a) w_b) x (u, 0), and the same x z
             {-sweep.z * uy, sweep.z * ux, sweep.x * uy - sweep.y * ux},
             {sweep.y, -sweep.x, 0.0}};
}

template <class T, class B, class S>
SOFTARM_INLINE auto acceleration(const T& p, const T& q, const T& p1, const T& q1,
                                 const Vec3<B>& base, const FrameAccelerationOf<S>& f) noexcept {
  return Vec3<decltype(base.x + p * f.on_p.x)>{
      base.x + p * f.on_p.x + q * f.on_q.x + p1 * f.on_p1.x + q1 * f.on_q1.x,
      base.y + p * f.on_p.y + q * f.on_q.y + p1 * f.on_p1.y + q1 * f.on_q1.y,
      base.z + p * f.on_p.z + q * f.on_q.z + p1 * f.on_p1.z};
}
template <class T, class B>
SOFTARM_INLINE Vec3<B> acceleration(const T&, const T&, const T&, const T&, const Vec3<B>& base,
                                    StillFrame) noexcept {
  return base;
}

/// (P1 u, Q1) . acceleration over the arc. The sweep's shares cancel: u . (v x z) + z . (v x u) =
/// 0.
template <class L, class S>
inline auto arc_stretch(const SegmentLanesOf<L>& k, int l,
                        const FrameAccelerationOf<S>& f) noexcept {
  const auto ux = at(k.ux, l), uy = at(k.uy, l);
  return at(k.arc.pp1, l) * (ux * f.on_p.x + uy * f.on_p.y) + at(k.arc.pq1, l) * f.on_p.z +
         at(k.arc.qp1, l) * (ux * f.on_q.x + uy * f.on_q.y) + at(k.arc.qq1, l) * f.on_q.z;
}
template <class L>
inline double arc_stretch(const SegmentLanesOf<L>&, int, StillFrame) noexcept {
  return 0.0;
}

/// [d(p u, q)/du]^T F with the derivative's stretch . F already summed.
template <class T, class S>
inline void set_torque(const T& ux, const T& uy, const S& x, const S& y, const S& stretch,
                       SegmentForcesOf<S>& out) noexcept {
  out.torque_x = x + stretch * ux;
  out.torque_y = y + stretch * uy;
}

/// (p u, q) . F
template <class T, class S>
inline auto virial(const T& ux, const T& uy, const T& p, const T& q, const Vec3<S>& F) noexcept {
  return p * (ux * F.x + uy * F.y) + q * F.z;
}

/// All mass in the centre. Gravity alone does the same to an arc.
template <class Segments, class Forces>
inline void point_forces(const Segments& k, int l, Forces& out) noexcept {
  const auto ux = at(k.ux, l), uy = at(k.uy, l), p = at(k.centre.p, l), q = at(k.centre.q, l);
  const auto& F = out.force;
  out.moment = cross(Vec3<std::remove_cv_t<decltype(p)>>{p * ux, p * uy, q}, F);
  set_torque(ux, uy, p * F.x, p * F.y,
             at(k.centre.p1, l) * (ux * F.x + uy * F.y) + at(k.centre.q1, l) * F.z, out);
  if constexpr (Segments::kExtensible) out.virial = virial(ux, uy, p, q, F);
}

/// Mass along the arc: the integrals of P, Q and (P1 u, Q1) times the acceleration.
template <class Segments, class Weight, class Frame, class Forces>
SOFTARM_INLINE void arc_forces(const Segments& k, int l, const Vec3<Weight>& weight, const Frame& f,
                               Forces& out) noexcept {
  const auto ux = at(k.ux, l), uy = at(k.uy, l);
  const auto& m = k.arc;
  const auto on_p = acceleration(at(m.pp, l), at(m.pq, l), at(m.pp1, l), at(m.pq1, l),
                                 at(k.centre.p, l) * weight + lane(k.own_p, l), f);
  const auto on_q = acceleration(at(m.pq, l), at(m.qq, l), at(m.qp1, l), at(m.qq1, l),
                                 at(k.centre.q, l) * weight + lane(k.own_q, l), f);
  const auto stretch = at(k.own_stretch, l) + at(k.centre.p1, l) * (ux * weight.x + uy * weight.y) +
                       at(k.centre.q1, l) * weight.z + arc_stretch(k, l, f);
  out.moment = {uy * on_p.z - on_q.y, on_q.x - ux * on_p.z, ux * on_p.y - uy * on_p.x};
  set_torque(ux, uy, on_p.x, on_p.y, stretch, out);
  if constexpr (Segments::kExtensible) out.virial = ux * on_p.x + uy * on_p.y + on_q.z;
}

/// A thick cross-section of radius r turns with the arc.
template <bool kInertia, bool kCoriolis, class Segments, class S, class Forces>
void add_rotary_inertia(const SegmentParameters& segment, const double* x, int l, const Segments& k,
                        const FrameMotionOf<S>& m, Forces& out) noexcept {
  using T = decltype(at(k.ux, l));
  const double r = segment.radius_m;
  DiscMotion<S, T> motion{m.spin_a, m.spin_b, m.angular, at(k.ux, l), at(k.uy, l), {}, {}, {}};
  if constexpr (kCoriolis) {
    motion.a = lane(k.a, l);
    motion.b = lane(k.b, l);
  }
  if constexpr (kInertia) {
    motion.x = direction(motion.ux, motion.uy, x[0], x[1]);
  }
  const auto discs = disc_forces(0.25 * segment.mass_kg * r * r, motion);
  out.moment += discs.moment;
  out.torque_x += discs.torque_x;
  out.torque_y += discs.torque_y;
}

template <MassModel kMass, class Segments, class S, class Frame, class Forces>
SOFTARM_INLINE void own_forces(const Segments& k, int l, const Vec3<S>& base, const Frame& f,
                               Forces& out) noexcept {
  const double mass = at(k.mass, l);
  out.force = mass * acceleration(at(k.centre.p, l), at(k.centre.q, l), at(k.centre.p1, l),
                                  at(k.centre.q1, l), base + lane(k.own_centre, l), f);
  if constexpr (kMass == MassModel::point) {
    point_forces(k, l, out);
  } else {
    arc_forces(k, l, mass * base, f, out);
  }
}

/// Accelerations of S_i, still in the axes of S_{i-1}.
template <class Segments, class Frame, class S>
SOFTARM_INLINE auto end_acceleration(const Segments& k, int l, const Frame& f,
                                     const FrameMotionOf<S>& m) noexcept {
  return acceleration(at(k.tip.p, l), at(k.tip.q, l), at(k.tip.p1, l), at(k.tip.q1, l),
                      m.linear + lane(k.own_tip, l), f);
}
template <bool kCoriolis, class Segments, class Frame, class S>
SOFTARM_INLINE auto end_angular_acceleration(const Segments& k, int l, const Frame&,
                                             const FrameMotionOf<S>& m) noexcept {
  auto angular = m.angular + lane(k.own_spin, l);
  if constexpr (kCoriolis && !std::is_same_v<Frame, StillFrame>) {
    angular += 0.5 * (cross(m.spin_a, lane(k.spin_b, l)) + cross(m.spin_b, lane(k.spin_a, l)));
  }
  return angular;
}

/// From S_{i-1} to S_i.
template <bool kCoriolis, class Segments, class Frame, class S>
SOFTARM_INLINE void advance(const Segments& k, int l, const Frame& f, const FrameMotionOf<S>& m,
                            FrameMotionOf<S>& next) noexcept {
  const auto to_next = turn(k, l);
  next.linear = rotate_back(to_next, end_acceleration(k, l, f, m));
  const auto angular = end_angular_acceleration<kCoriolis>(k, l, f, m);
  if constexpr (kCoriolis) {
    next.spin_a = rotate_back(to_next, m.spin_a + lane(k.spin_a, l));
    next.spin_b = rotate_back(to_next, m.spin_b + lane(k.spin_b, l));
  }
  next.angular = rotate_back(to_next, angular);
}

/// What force and moment (about p_i) of everything beyond p_i do to the segment's own u.
template <class Segments, class S>
SOFTARM_INLINE auto torque_from_beyond(const Segments& k, int l, const Vec3<S>& force,
                                       const Vec3<S>& moment) noexcept {
  const auto ux = at(k.ux, l), uy = at(k.uy, l), p = at(k.tip.p, l);
  const auto c1 = at(k.turn_rate.c1, l);
  const auto twist = at(k.turn_rate.c2, l) * moment.z;
  const auto stretch = at(k.tip.p1, l) * (ux * force.x + uy * force.y) + at(k.tip.q1, l) * force.z +
                       at(k.turn_rate.c3, l) * (ux * moment.y - uy * moment.x);
  return std::pair{p * force.x + c1 * moment.y + stretch * ux - twist * uy,
                   p * force.y - c1 * moment.x + stretch * uy + twist * ux};
}

}  // namespace softarm::recursion
