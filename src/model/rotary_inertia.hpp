// Rotary inertia of a thick cross-section: what thin discs along the arc add to a segment's moment
// and torque. The paper leaves it out.
//
// A disc of mass dm has the inertia j (1 + e e') with j = dm r^2 / 4 and e the tangent, and turns
// as a segment bent by x u would. The bilinear form of the rate of its angular momentum is
//   H = J alpha + (w_a x J w_b + w_b x J w_a) / 2 = j (alpha + e (e . alpha)
//       + ((e . w_b) w_a x e + (e . w_a) w_b x e) / 2).
// Gauss and Legendre's 16 points along the arc, four at a time, reach round-off up to |u| = 7.
#pragma once

#include <array>
#include <type_traits>

#include "model/dual.hpp"
#include "model/segment_geometry.hpp"

namespace softarm {

/// Motion of S_{i-1} in its own axes, and the directions of the bilinear form in it.
template <class S, class T>
struct DiscMotion {
  Vec3<S> spin_a, spin_b, angular;
  T ux, uy;
  DirectionOf<T, double> a, b, x;
};

template <class S>
struct DiscForces {
  Vec3<S> moment;  ///< in S_{i-1}
  S torque_x, torque_y;
};

namespace detail {

/// Nodes and weights on [0, 1].
inline constexpr std::array<Lanes, 4> kArcNodes = {
    Lanes{0.00529953250417503370, 0.02771248846338371196, 0.06718439880608412806,
          0.12229779582249848305},
    Lanes{0.19106187779867812578, 0.27099161117138630683, 0.35919822461037054338,
          0.45249374508118127991},
    Lanes{0.54750625491881872009, 0.64080177538962945662, 0.72900838882861369317,
          0.80893812220132187422},
    Lanes{0.87770220417750151695, 0.93281560119391587194, 0.97228751153661628804,
          0.99470046749582496630}};
inline constexpr std::array<Lanes, 4> kArcWeights = {
    Lanes{0.01357622970587704743, 0.03112676196932394643, 0.04757925584124639240,
          0.06231448562776693603},
    Lanes{0.07479799440828836604, 0.08457825969750126909, 0.09130170752246179443,
          0.09472530522753424814},
    Lanes{0.09472530522753424814, 0.09130170752246179443, 0.08457825969750126909,
          0.07479799440828836604},
    Lanes{0.06231448562776693603, 0.04757925584124639240, 0.03112676196932394643,
          0.01357622970587704743}};

inline double sum(const Lanes& v) noexcept { return (v[0] + v[1]) + (v[2] + v[3]); }
inline BendingDual sum(const BendingLanes& a) noexcept {
  return {sum(a.v), Pair{sum(a.d.along[0]), sum(a.d.along[1])}};
}
inline StretchDual sum(const StretchLanes& a) noexcept {
  return {sum(a.v), Quad{sum(a.d.along[0]), sum(a.d.along[1]), sum(a.d.along[2]), 0.0}};
}

/// One number for all nodes.
inline double spread(double a) noexcept { return a; }
inline BendingLanes spread(const BendingDual& a) noexcept {
  return {Lanes{} + a.v, LaneTangents<2>{{Lanes{} + a.d[0], Lanes{} + a.d[1]}}};
}
inline StretchLanes spread(const StretchDual& a) noexcept {
  return {Lanes{} + a.v, LaneTangents<3>{{Lanes{} + a.d[0], Lanes{} + a.d[1], Lanes{} + a.d[2]}}};
}
template <class S>
auto spread(const Vec3<S>& v) noexcept {
  return Vec3<decltype(spread(v.x))>{spread(v.x), spread(v.y), spread(v.z)};
}

}  // namespace detail

/// @param inertia mu r^2 / 4 of the whole segment, kg m^2.
template <class S, class T>
auto disc_forces(double inertia, const DiscMotion<S, T>& m) noexcept {
  using detail::spread, detail::sum;
  using R = decltype(spread(m.angular.x) * (Lanes{} * spread(m.ux)));
  const auto spin_a = spread(m.spin_a), spin_b = spread(m.spin_b);
  const auto frame_angular = spread(m.angular);
  const auto spread_direction = [](const Lanes& x, const DirectionOf<T, double>& d, const auto& ux,
                                   const auto& uy) { return direction(ux, uy, x * d.x, x * d.y); };
  Vec3<R> moment{};
  R torque_x{}, torque_y{};
  for (std::size_t node = 0; node < detail::kArcNodes.size(); ++node) {
    const Lanes x = detail::kArcNodes[node], weight = inertia * detail::kArcWeights[node];
    const auto ux = x * spread(m.ux), uy = x * spread(m.uy);
    const auto c = entire<8>(ux * ux + uy * uy);
    const auto turn_rate = spin(c);
    const auto along_a = spread_direction(x, m.a, ux, uy);
    const auto along_b = spread_direction(x, m.b, ux, uy);
    const auto along_x = spread_direction(x, m.x, ux, uy);
    const auto own_a = first(turn_rate, ux, uy, along_a);
    const auto own_b = first(turn_rate, ux, uy, along_b);
    const auto a = spin_a + own_a, b = spin_b + own_b;
    const auto angular = frame_angular + second(turn_rate, ux, uy, along_a, along_b) +
                         first(turn_rate, ux, uy, along_x) +
                         0.5 * (cross(spin_a, own_b) + cross(spin_b, own_a));
    const Vec3<std::remove_cv_t<decltype(ux)>> tangent{c[1] * ux, c[1] * uy, c[0]};
    const auto gyroscopic = cross(dot(tangent, b) * a + dot(tangent, a) * b, tangent);
    const auto H = weight * (angular + dot(tangent, angular) * tangent + 0.5 * gyroscopic);
    moment += H;
    const auto stretch = turn_rate.c3 * (ux * H.y - uy * H.x);
    torque_x += x * (turn_rate.c1 * H.y + stretch * ux - turn_rate.c2 * uy * H.z);
    torque_y += x * (-turn_rate.c1 * H.x + stretch * uy + turn_rate.c2 * ux * H.z);
  }
  return DiscForces<decltype(sum(torque_x))>{
      {sum(moment.x), sum(moment.y), sum(moment.z)}, sum(torque_x), sum(torque_y)};
}

}  // namespace softarm
