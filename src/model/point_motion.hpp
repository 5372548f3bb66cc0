// How a point of a segment moves: its place, its columns and their rates. The one place where a
// segment's own length enters as a coordinate.
//
// A point of the segment is linear in its length l: r = l f(u). So dr/de = r / l, whose rate is
// that of r at constant length over l, and the other columns grow as l does.
#pragma once

#include <type_traits>

#include "model/quad.hpp"
#include "model/segment_geometry.hpp"

namespace softarm {

/// Columns of one segment side by side: along u_x and u_y, and where segments stretch along e, with
/// a zero to fill the register.
template <bool kExtensible>
using Columns = std::conditional_t<kExtensible, Quad, Pair>;
template <bool kExtensible>
inline constexpr int kCoordinates = kExtensible ? 3 : 2;

/// What a segment's own length does: nothing, unless it stretches.
template <bool kExtensible>
struct Stretch {};
template <>
struct Stretch<true> {
  double strain_rate;     ///< e' / l
  double inverse_length;  ///< 1 / l
};

/// State of one segment in S_{i-1}.
template <bool kExtensible>
struct SegmentState {
  double ux, uy;
  Direction v;   ///< u'
  Vector3 spin;  ///< angular velocity of S_{i-1}
  [[no_unique_address]] Stretch<kExtensible> stretch;
};

template <bool kExtensible>
struct PointMotion {
  Vector3 place, rate;  ///< r from p_{i-1} and its rate relative to p_{i-1}, in the world
  Vec3<Columns<kExtensible>> J, J_rate;  ///< columns of r and their rates in the world
};

/// Along u_x, u_y and e.
inline Quad beside(const Pair& u, double e) noexcept { return Quad{u[0], u[1], e, 0.0}; }
inline Vec3<Quad> beside(const PairVector3& u, const Vector3& e) noexcept {
  return {beside(u.x, e.x), beside(u.y, e.y), beside(u.z, e.z)};
}

/// Columns that e does not turn.
template <bool kExtensible>
Vec3<Columns<kExtensible>> without_elongation(const PairVector3& u) noexcept {
  if constexpr (kExtensible) {
    return beside(u, {0.0, 0.0, 0.0});
  } else {
    return u;
  }
}

/// Of a point whose curve has the present length.
template <bool kExtensible>
[[gnu::always_inline]] inline PointMotion<kExtensible> point_motion(
    const Curve& f, const SegmentState<kExtensible>& state) noexcept {
  const double ux = state.ux, uy = state.uy;
  const Vector3 place = point(f, ux, uy);
  const Vector3 rate = first(f, ux, uy, state.v) + cross(state.spin, place);
  const PairVector3 J = columns(f, ux, uy);
  const PairVector3 J_rate = column_rates(f, ux, uy, state.v) + cross(state.spin, J);
  if constexpr (kExtensible) {
    const auto [strain_rate, inverse_length] = state.stretch;
    return {place, rate + strain_rate * place, beside(J, inverse_length * place),
            beside(J_rate + strain_rate * J, inverse_length * rate)};
  } else {
    return {place, rate, J, J_rate};
  }
}

}  // namespace softarm
