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

#include "model/segment_geometry.hpp"

namespace softarm {

/// Motion of S_{i-1} in its own axes, and the directions of the bilinear form in it.
struct DiscMotion {
  Vector3 spin_a, spin_b, angular;
  double ux, uy;
  Direction a, b, x;
};

struct DiscForces {
  Vector3 moment;  ///< in S_{i-1}
  double torque_x, torque_y;
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

}  // namespace detail

/// @param inertia mu r^2 / 4 of the whole segment, kg m^2.
inline DiscForces disc_forces(double inertia, const DiscMotion& m) noexcept {
  Vec3<Lanes> moment{};
  Lanes torque_x{}, torque_y{};
  for (std::size_t node = 0; node < detail::kArcNodes.size(); ++node) {
    const Lanes x = detail::kArcNodes[node], weight = inertia * detail::kArcWeights[node];
    const Lanes ux = x * m.ux, uy = x * m.uy;
    const auto c = entire<8>(ux * ux + uy * uy);
    const SpinOf<Lanes> turn_rate = spin(c);
    const auto along_a = direction(ux, uy, x * m.a.x, x * m.a.y);
    const auto along_b = direction(ux, uy, x * m.b.x, x * m.b.y);
    const auto along_x = direction(ux, uy, x * m.x.x, x * m.x.y);
    const Vec3<Lanes> own_a = first(turn_rate, ux, uy, along_a);
    const Vec3<Lanes> own_b = first(turn_rate, ux, uy, along_b);
    const Vec3<Lanes> a = m.spin_a + own_a, b = m.spin_b + own_b;
    const Vec3<Lanes> angular = m.angular + second(turn_rate, ux, uy, along_a, along_b) +
                                first(turn_rate, ux, uy, along_x) +
                                0.5 * (cross(m.spin_a, own_b) + cross(m.spin_b, own_a));
    const Vec3<Lanes> tangent{c[1] * ux, c[1] * uy, c[0]};
    const Vec3<Lanes> gyroscopic = cross(dot(tangent, b) * a + dot(tangent, a) * b, tangent);
    const Vec3<Lanes> H = weight * (angular + dot(tangent, angular) * tangent + 0.5 * gyroscopic);
    moment += H;
    const Lanes stretch = turn_rate.c3 * (ux * H.y - uy * H.x);
    torque_x += x * (turn_rate.c1 * H.y + stretch * ux - turn_rate.c2 * uy * H.z);
    torque_y += x * (-turn_rate.c1 * H.x + stretch * uy + turn_rate.c2 * ux * H.z);
  }
  using detail::sum;
  return {{sum(moment.x), sum(moment.y), sum(moment.z)}, sum(torque_x), sum(torque_y)};
}

}  // namespace softarm
