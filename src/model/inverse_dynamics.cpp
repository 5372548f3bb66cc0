// B x + C(u, a) b + G by one pass from base to tip and one back (Newton-Euler), bilinear in a and
// b.
//
// Everything is written in the local frames S_{i-1}; no far origin is ever used, so long chains and
// unequal segments keep their digits. Outward, the second derivative of the frames along a and b is
// carried: D_a D_b R = M R with M = [alpha]x + ([w_a]x [w_b]x + [w_b]x [w_a]x) / 2. What B adds,
// the first derivative along x, enters the same two places, and gravity is an acceleration of the
// base. What a segment does within its own frame depends on no other: four segments at a time
// (segment_lanes.hpp).
//
// A segment that stretches is r = l f(u): with strain rates e_a = a_e / l and so on, D_a r is
// first(a) + e_a r, and D_a D_b r + D_x r is that of constant length with x + e_b a + e_a b in place
// of x, plus e_x r. To the frame a growing body is one with alpha + e_b w_a + e_a w_b. The force on
// e is the virial r . F over l.
#include <Eigen/Core>
#include <array>

#include "model/segment_forces.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {
namespace {

using namespace recursion;
using FrameMotion = FrameMotionOf<double>;
template <bool kExtensible>
using PlainLanes = LanesOf<kExtensible, Lanes>;
template <bool kExtensible>
using PlainForces = ForcesOf<kExtensible, double>;

template <MassModel kMass, bool kExtensible, bool kInertia, bool kCoriolis>
void outward(const ArmParameters& arm, const Inputs& in, Vector3 base,
             PlainLanes<kExtensible>* lanes, PlainForces<kExtensible>* out) noexcept {
  const int n = arm.size();
  FrameMotion m{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, base};
  const auto add_thickness = [&](int i, const auto& k) {
    if constexpr (kMass == MassModel::distributed) {
      const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
      if (segment.radius_m > 0.0) {
        add_rotary_inertia<kInertia, kCoriolis>(segment, in.x + kCoordinates<kExtensible> * i,
                                                lane_of(i), k, m, out[i]);
      }
    }
  };
  for (int i = 0; i < n; ++i) {
    auto& k = lanes[group_of(i)];
    const int l = lane_of(i);
    if (l == 0) prepare<kMass, kInertia, kCoriolis>(arm, in, i, k);
    const bool last = i + 1 == n;
    if constexpr (!kInertia && !kCoriolis) {
      out[i].force = k.mass[l] * m.linear;
      point_forces(k, l, out[i]);
      if (!last) m.linear = rotate_back(turn(k, l), m.linear);
    } else if (i == 0) {
      own_forces<kMass>(k, l, m.linear, StillFrame{}, out[i]);
      add_thickness(i, k);
      if (!last) advance<kCoriolis>(k, l, StillFrame{}, m, m);
    } else {
      const auto f = frame_acceleration<kCoriolis>(m, k, l);
      own_forces<kMass>(k, l, m.linear, f, out[i]);
      add_thickness(i, k);
      if (!last) advance<kCoriolis>(k, l, f, m, m);
    }
  }
}

template <bool kExtensible>
void inward(int n, const PlainLanes<kExtensible>* lanes, const PlainForces<kExtensible>* segments,
            double* out) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  const auto& last = segments[n - 1];
  double* const last_out = out + kWidth * (n - 1);
  last_out[0] = last.torque_x;
  last_out[1] = last.torque_y;
  if constexpr (kExtensible) {
    last_out[2] = last.virial * lanes[group_of(n - 1)].inverse_length[lane_of(n - 1)];
  }
  // Lanes of a Pair: force and moment (about p_i) of everything beyond p_i.
  PairVector3 beyond = side_by_side(last.force, last.moment);
  for (int i = n - 2; i >= 0; --i) {
    const auto& k = lanes[group_of(i)];
    const int l = lane_of(i);
    const auto& own = segments[i];
    beyond = rotate(turn(k, l), beyond);
    const Vector3 force = column(beyond, 0), moment = column(beyond, 1);
    const double ux = k.ux[l], uy = k.uy[l], p = k.tip.p[l];
    const auto [x, y] = torque_from_beyond(k, l, force, moment);
    out[kWidth * i] = own.torque_x + x;
    out[kWidth * i + 1] = own.torque_y + y;
    if constexpr (kExtensible) {
      out[kWidth * i + 2] =
          (own.virial + virial(ux, uy, p, k.tip.q[l], force)) * k.inverse_length[l];
    }
    if (i == 0) return;
    const Vector3 lever = cross(Vector3{p * ux, p * uy, k.tip.q[l]}, force);
    beyond += side_by_side(own.force, own.moment + lever);
  }
}

template <bool kExtensible>
using Outward = void (*)(const ArmParameters&, const Inputs&, Vector3, PlainLanes<kExtensible>*,
                         PlainForces<kExtensible>*) noexcept;

/// By whether there is inertia, and Coriolis.
template <MassModel kMass, bool kExtensible>
constexpr std::array<std::array<Outward<kExtensible>, 2>, 2> kOutward{{
    {outward<kMass, kExtensible, false, false>, outward<kMass, kExtensible, false, true>},
    {outward<kMass, kExtensible, true, false>, outward<kMass, kExtensible, true, true>},
}};

template <bool kExtensible>
void newton_euler(const ArmParameters& arm, const Inputs& in, const DynamicsTerms& terms,
                  const Vector3& base, SegmentStorage<kExtensible>& s, double* out) noexcept {
  const auto& run = arm.mass == MassModel::point ? kOutward<MassModel::point, kExtensible>
                                                 : kOutward<MassModel::distributed, kExtensible>;
  run[terms.inertia][terms.coriolis](arm, in, base, s.lanes.data(), s.forces.data());
  inward<kExtensible>(arm.size(), s.lanes.data(), s.forces.data(), out);
}

}  // namespace

void inverse_dynamics(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                      ConstVectorRef velocity_a, ConstVectorRef velocity_b,
                      ConstVectorRef acceleration, DynamicsTerms terms, VectorRef out) noexcept {
  auto& s = workspace.storage();
  const Inputs in{u.data(), velocity_a.data(), velocity_b.data(), acceleration.data()};
  Vector3 base{0, 0, 0};
  if (terms.gravity) base = from_eigen(-(arm.base_rotation.transpose() * arm.gravity_mps2));
  if (arm.extensible) return newton_euler(arm, in, terms, base, s.extensible, out.data());
  newton_euler(arm, in, terms, base, s.inextensible, out.data());
}

}  // namespace softarm
