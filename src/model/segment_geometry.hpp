// Position and rotation of one segment and their derivatives up to the second, in S_{i-1}, without
// a division by theta.
#pragma once

#include "model/entire_series.hpp"
#include "model/vec3.hpp"

namespace softarm {

/// A curve L (P(s) u, Q(s)) of u with its derivatives by s, written p1 = 2 dP/ds, p2 = 4 d2P/ds2
/// because that is how they meet u: dP(s(u)) = p1 (u . du). Segment tip: P = c2, Q = c1. Centre of
/// mass: P = c3, Q = c2.
template <class T>
struct CurveOf {
  T p, q, p1, q1, p2, q2;
};
using Curve = CurveOf<double>;

template <class Length, class Functions>
inline CurveOf<typename Functions::value_type> tip_curve(const Length& length,
                                                         const Functions& c) noexcept {
  return {length * c[2],
          length * c[1],
          length * (2.0 * c[4] - c[3]),
          length * (c[3] - c[2]),
          length * (8.0 * c[6] - 5.0 * c[5] + c[4]),
          length * (3.0 * (c[5] - c[4]) + c[3])};
}

template <class Length, class Functions>
inline CurveOf<typename Functions::value_type> centre_curve(const Length& length,
                                                            const Functions& c) noexcept {
  return {length * c[3],
          length * c[2],
          length * (3.0 * c[5] - c[4]),
          length * (2.0 * c[4] - c[3]),
          length * (15.0 * c[7] - 7.0 * c[6] + c[5]),
          length * (8.0 * c[6] - 5.0 * c[5] + c[4])};
}

/// A direction of u beside u itself, with u . a, which everything below shares. Its own components
/// may be plain numbers where u has tangents.
template <class T, class Component = T>
struct DirectionOf {
  Component x, y;
  T along;
};
using Direction = DirectionOf<double>;

template <class T, class Component>
inline DirectionOf<T, Component> direction(const T& ux, const T& uy, const Component& x,
                                           const Component& y) noexcept {
  return {x, y, ux * x + uy * y};
}

template <class T>
inline Vec3<T> point(const CurveOf<T>& f, T ux, T uy) noexcept {
  return {f.p * ux, f.p * uy, f.q};
}

/// Derivative of the point along a.
template <class T, class Component>
inline Vec3<T> first(const CurveOf<T>& f, T ux, T uy, const DirectionOf<T, Component>& a) noexcept {
  const T stretch = f.p1 * a.along;
  return {f.p * a.x + stretch * ux, f.p * a.y + stretch * uy, f.q1 * a.along};
}

/// Mixed second derivative of the point along a and b.
template <class T, class Component>
inline Vec3<T> second(const CurveOf<T>& f, T ux, T uy, const DirectionOf<T, Component>& a,
                      const DirectionOf<T, Component>& b) noexcept {
  const Component ab = a.x * b.x + a.y * b.y;
  const T both = a.along * b.along;
  const T stretch = f.p1 * ab + f.p2 * both;
  return {f.p1 * (b.along * a.x + a.along * b.x) + stretch * ux,
          f.p1 * (b.along * a.y + a.along * b.y) + stretch * uy, f.q1 * ab + f.q2 * both};
}

/// Both columns d point / d u_x, d point / d u_y.
inline PairVector3 columns(const Curve& f, double ux, double uy) noexcept {
  const Pair u{ux, uy};
  return {Pair{f.p, 0.0} + (f.p1 * ux) * u, Pair{0.0, f.p} + (f.p1 * uy) * u, f.q1 * u};
}

/// Time derivatives of both columns along v.
inline PairVector3 column_rates(const Curve& f, double ux, double uy, const Direction& v) noexcept {
  const Pair u{ux, uy};
  const Pair stretch = f.p1 * Pair{v.x, v.y} + (f.p2 * v.along) * u;
  const double diagonal = f.p1 * v.along;
  return {Pair{diagonal, 0.0} + (f.p1 * v.x) * u + ux * stretch,
          Pair{0.0, diagonal} + (f.p1 * v.y) * u + uy * stretch,
          f.q1 * Pair{v.x, v.y} + (f.q2 * v.along) * u};
}

/// R = I + c1 [w]x + c2 [w]x^2 of S_i in S_{i-1}, w = (-u_y, u_x, 0), applied in ten operations.
template <class S>
struct TurnOf {
  S ux, uy, c0, c1, c2;
};
using Turn = TurnOf<double>;
template <class S, class T>
inline auto rotate(const TurnOf<S>& r, const Vec3<T>& v) noexcept {
  const auto along = r.ux * v.x + r.uy * v.y;
  const auto shift = r.c1 * v.z - r.c2 * along;
  return Vec3<decltype(r.ux * v.x)>{v.x + r.ux * shift, v.y + r.uy * shift,
                                    r.c0 * v.z - r.c1 * along};
}
template <class S, class T>
inline auto rotate_back(const TurnOf<S>& r, const Vec3<T>& v) noexcept {
  const auto along = r.ux * v.x + r.uy * v.y;
  const auto shift = r.c1 * v.z + r.c2 * along;
  return Vec3<decltype(r.ux * v.x)>{v.x - r.ux * shift, v.y - r.uy * shift,
                                    r.c0 * v.z + r.c1 * along};
}

/// Coefficients of the angular velocity of S_i relative to S_{i-1}, written in S_{i-1}:
/// xy = J (c1 a + c3 u (u . a)) with J (x, y) = (-y, x), z = c2 (u x a).
template <class T>
struct SpinOf {
  T c1, c2, c3;
  T mixed;  ///< c3 + dc1/ds = (2 c3 - c2) / 2, of the symmetrized second derivative
  T c3_1;   ///< 2 dc3/ds
  T c2_1;   ///< dc2/ds
};
using Spin = SpinOf<double>;

template <class Functions>
inline auto spin(const Functions& c) noexcept {
  using T = typename Functions::value_type;
  return SpinOf<T>{c[1], c[2], c[3], c[3] - 0.5 * c[2], 3.0 * c[5] - c[4], c[4] - 0.5 * c[3]};
}

template <class T, class Component>
inline Vec3<T> first(const SpinOf<T>& w, T ux, T uy, const DirectionOf<T, Component>& a) noexcept {
  const T along = w.c3 * a.along;
  return {-(w.c1 * a.y + along * uy), w.c1 * a.x + along * ux, w.c2 * (ux * a.y - uy * a.x)};
}

/// Symmetrized second derivative: the axial vector of (d2R/dadb) R^T, halved over both orders.
template <class T, class Component>
inline Vec3<T> second(const SpinOf<T>& w, T ux, T uy, const DirectionOf<T, Component>& a,
                      const DirectionOf<T, Component>& b) noexcept {
  const Component ab = a.x * b.x + a.y * b.y;
  const T along = w.c3 * ab + w.c3_1 * a.along * b.along;
  const T x = w.mixed * (b.along * a.x + a.along * b.x) + along * ux;
  const T y = w.mixed * (b.along * a.y + a.along * b.y) + along * uy;
  return {-y, x, w.c2_1 * (b.along * (ux * a.y - uy * a.x) + a.along * (ux * b.y - uy * b.x))};
}

inline PairVector3 columns(const Spin& w, double ux, double uy) noexcept {
  const Pair u{ux, uy};
  return {-(Pair{0.0, w.c1} + (w.c3 * uy) * u), Pair{w.c1, 0.0} + (w.c3 * ux) * u,
          w.c2 * Pair{-uy, ux}};
}

/// Time derivatives of both columns along v, in S_{i-1}.
inline PairVector3 column_rates(const Spin& w, double ux, double uy, const Direction& v) noexcept {
  const Pair u{ux, uy};
  const Pair dv{v.x, v.y};
  const double c1_rate = (2.0 * w.mixed - w.c3) * v.along;  // 2 dc1/ds = c3 - c2
  const double c3_rate = w.c3_1 * v.along;
  const double c2_rate = 2.0 * w.c2_1 * v.along;
  const Pair stretch = c3_rate * u + w.c3 * dv;
  return {-(Pair{0.0, c1_rate} + (w.c3 * v.y) * u + uy * stretch),
          Pair{c1_rate, 0.0} + (w.c3 * v.x) * u + ux * stretch,
          c2_rate * Pair{-uy, ux} + w.c2 * Pair{-v.y, v.x}};
}

}  // namespace softarm
