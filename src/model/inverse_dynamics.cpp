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
#include <type_traits>

#include "model/dynamics_storage.hpp"
#include "model/rotary_inertia.hpp"
#include "softarm/model/dynamics.hpp"

// In line at both of its places, for the base and for a moving frame: g++ would leave one a call.
#define SOFTARM_INLINE [[gnu::always_inline]] inline

namespace softarm {
namespace {

/// Inputs of inverse_dynamics, 2n numbers each, 3n where segments stretch.
struct Inputs {
  const double* u;
  const double* a;
  const double* b;
  const double* x;
};

/// Derivative along x, and twice along a and b.
template <bool kFirst, bool kSecond, class Coefficients, class Segments>
Vec3<Lanes> own(const Coefficients& f, const Segments& k, const DirectionOf<Lanes>& x) noexcept {
  if constexpr (kFirst && kSecond) {
    return second(f, k.ux, k.uy, k.a, k.b) + first(f, k.ux, k.uy, x);
  }
  if constexpr (kSecond) return second(f, k.ux, k.uy, k.a, k.b);
  return first(f, k.ux, k.uy, x);
}

/// The arc's acceleration within its frame is P x + P1 g + P2 kappa u in the plane and Q1 beta + Q2
/// kappa along z.
SOFTARM_INLINE void own_arc(const DirectionOf<Lanes>& x, SegmentLanes& k) noexcept {
  const auto& m = k.arc;
  const Lanes ux = k.ux, uy = k.uy, s = ux * ux + uy * uy;
  const Lanes beta = k.a.x * k.b.x + k.a.y * k.b.y + x.along;
  const Lanes kappa = k.a.along * k.b.along;
  const Lanes g_x = k.b.along * k.a.x + k.a.along * k.b.x + beta * ux;
  const Lanes g_y = k.b.along * k.a.y + k.a.along * k.b.y + beta * uy;
  const Lanes on_p = m.pp2 * kappa, on_q = m.qp2 * kappa;
  k.own_p = {m.pp * x.x + m.pp1 * g_x + on_p * ux, m.pp * x.y + m.pp1 * g_y + on_p * uy,
             m.pq1 * beta + m.pq2 * kappa};
  k.own_q = {m.pq * x.x + m.qp1 * g_x + on_q * ux, m.pq * x.y + m.qp1 * g_y + on_q * uy,
             m.qq1 * beta + m.qq2 * kappa};
  // u . g = 2 kappa + beta s
  k.own_stretch = m.pp1 * x.along + m.p1p1 * (2.0 * kappa + beta * s) + m.p1p2 * kappa * s +
                  m.q1q1 * beta + m.q1q2 * kappa;
}

/// Adds e_x r to what points do within the segment's frame.
template <bool kArc>
void add_strain(const Lanes& strain_x, ExtensibleLanes& k) noexcept {
  k.own_tip += strain_x * point(k.tip, k.ux, k.uy);
  k.own_centre += strain_x * point(k.centre, k.ux, k.uy);
  if constexpr (!kArc) return;
  const auto& m = k.arc;
  const Lanes on_p = strain_x * m.pp, on_q = strain_x * m.pq;
  k.own_p += Vec3<Lanes>{on_p * k.ux, on_p * k.uy, on_q};
  k.own_q += Vec3<Lanes>{on_q * k.ux, on_q * k.uy, strain_x * m.qq};
  k.own_stretch += strain_x * (m.pp1 * (k.ux * k.ux + k.uy * k.uy) + m.qq1);
}

/// What segments `begin` ... `begin + 3` do within their own frames; lanes beyond the last segment
/// are straight and weigh nothing.
template <MassModel kMass, bool kInertia, bool kCoriolis, class Segments>
void prepare(const ArmParameters& arm, const Inputs& in, int begin, Segments& k) noexcept {
  constexpr bool kExtensible = Segments::kExtensible;
  constexpr bool kArc = kMass == MassModel::distributed && (kInertia || kCoriolis);
  constexpr bool kFirst = kInertia || (kExtensible && kCoriolis);
  constexpr int kWidth = kCoordinates<kExtensible>;
  const int count = arm.size() - begin;
  const int at = kWidth * begin;
  k.ux = load(in.u + at, kWidth, count);
  k.uy = load(in.u + at + 1, kWidth, count);
  const Lanes length = set_shape<kArc, kExtensible>(arm, begin, in.u + at, k);
  if constexpr (kExtensible) k.inverse_length = 1.0 / length;
  DirectionOf<Lanes> x{};
  if constexpr (kInertia) x = load_direction<kExtensible>(in.x + at, count, k);
  if constexpr (kCoriolis) {
    k.a = load_direction<kExtensible>(in.a + at, count, k);
    k.b = load_direction<kExtensible>(in.b + at, count, k);
    k.spin_a = first(k.turn_rate, k.ux, k.uy, k.a);
    k.spin_b = first(k.turn_rate, k.ux, k.uy, k.b);
  } else if constexpr (kArc) {
    k.a = k.b = DirectionOf<Lanes>{};
  }
  DirectionOf<Lanes> grown = x;  // x + e_b a + e_a b: of what has a length
  if constexpr (kExtensible && kCoriolis) {
    k.strain_a = load_strain_rate(in.a + at, count, k.inverse_length);
    k.strain_b = load_strain_rate(in.b + at, count, k.inverse_length);
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
    add_strain<kArc>(load_strain_rate(in.x + at, count, k.inverse_length), k);
  }
}

/// Motion of the frame S_{i-1}, in its own coordinates.
struct FrameMotion {
  Vector3 spin_a, spin_b;   ///< angular velocity along a, b
  Vector3 angular, linear;  ///< alpha and D_a D_b p - g, what x does included
};

/// The acceleration of a point (P u, Q) of the segment, beyond that of p_{i-1} and its own within
/// S_{i-1}: P on_p + Q on_q + P1 on_p1 + Q1 on_q1.
struct FrameAcceleration {
  Vector3 on_p, on_q, on_p1, on_q1;
};
/// The same of the base, which neither turns nor moves: nothing.
struct StillFrame {};

template <bool kCoriolis, class Segments>
SOFTARM_INLINE FrameAcceleration frame_acceleration(const FrameMotion& m, const Segments& k,
                                                    int l) noexcept {
  const double ux = k.ux[l], uy = k.uy[l];
  Vector3 al = m.angular;
  if constexpr (Segments::kExtensible && kCoriolis) {
    al += k.strain_b[l] * m.spin_a + k.strain_a[l] * m.spin_b;
  }
  if constexpr (!kCoriolis) {
    return {{al.z * -uy, al.z * ux, al.x * uy - al.y * ux}, {al.y, -al.x, 0.0}, {}, {}};
  }
  const Vector3 &a = m.spin_a, &b = m.spin_b;
  const double xx = a.x * b.x, yy = a.y * b.y, zz = a.z * b.z;
  const double xy = 0.5 * (a.x * b.y + a.y * b.x);
  const double xz = 0.5 * (a.x * b.z + a.z * b.x);
  const double yz = 0.5 * (a.y * b.z + a.z * b.y);
  const double ax = k.a.x[l], ay = k.a.y[l], bx = k.b.x[l], by = k.b.y[l];
  const Vector3 sweep = k.b.along[l] * a + k.a.along[l] * b;
  return {// M (u, 0) + w_a x b + w_b x a
          {xy * uy - (yy + zz) * ux - al.z * uy - (a.z * by + b.z * ay),
           xy * ux - (xx + zz) * uy + al.z * ux + (a.z * bx + b.z * ax),
           (xz - al.y) * ux + (yz + al.x) * uy + (a.x * by - a.y * bx) + (b.x * ay - b.y * ax)},
          // M z
          {xz + al.y, yz - al.x, -(xx + yy)},
          // ((u.b) w_a + (u.a) w_b) x (u, 0), and the same x z
          {-sweep.z * uy, sweep.z * ux, sweep.x * uy - sweep.y * ux},
          {sweep.y, -sweep.x, 0.0}};
}

SOFTARM_INLINE Vector3 acceleration(double p, double q, double p1, double q1, const Vector3& base,
                                    const FrameAcceleration& f) noexcept {
  return {base.x + p * f.on_p.x + q * f.on_q.x + p1 * f.on_p1.x + q1 * f.on_q1.x,
          base.y + p * f.on_p.y + q * f.on_q.y + p1 * f.on_p1.y + q1 * f.on_q1.y,
          base.z + p * f.on_p.z + q * f.on_q.z + p1 * f.on_p1.z};
}
SOFTARM_INLINE Vector3 acceleration(double, double, double, double, const Vector3& base,
                                    StillFrame) noexcept {
  return base;
}

/// (P1 u, Q1) . acceleration over the arc. The sweep's shares cancel: u . (v x z) + z . (v x u) =
/// 0.
inline double arc_stretch(const SegmentLanes& k, int l, const FrameAcceleration& f) noexcept {
  const double ux = k.ux[l], uy = k.uy[l];
  return k.arc.pp1[l] * (ux * f.on_p.x + uy * f.on_p.y) + k.arc.pq1[l] * f.on_p.z +
         k.arc.qp1[l] * (ux * f.on_q.x + uy * f.on_q.y) + k.arc.qq1[l] * f.on_q.z;
}
inline double arc_stretch(const SegmentLanes&, int, StillFrame) noexcept { return 0.0; }

/// [d(p u, q)/du]^T F with the derivative's stretch . F already summed.
inline void set_torque(double ux, double uy, double x, double y, double stretch,
                       SegmentForces& out) noexcept {
  out.torque_x = x + stretch * ux;
  out.torque_y = y + stretch * uy;
}

/// (p u, q) . F
inline double virial(double ux, double uy, double p, double q, const Vector3& F) noexcept {
  return p * (ux * F.x + uy * F.y) + q * F.z;
}

/// All mass in the centre. Gravity alone does the same to an arc.
template <class Segments, class Forces>
inline void point_forces(const Segments& k, int l, Forces& out) noexcept {
  const double ux = k.ux[l], uy = k.uy[l], p = k.centre.p[l];
  const Vector3& F = out.force;
  out.moment = cross(Vector3{p * ux, p * uy, k.centre.q[l]}, F);
  set_torque(ux, uy, p * F.x, p * F.y,
             k.centre.p1[l] * (ux * F.x + uy * F.y) + k.centre.q1[l] * F.z, out);
  if constexpr (Segments::kExtensible) out.virial = virial(ux, uy, p, k.centre.q[l], F);
}

/// Mass along the arc: the integrals of P, Q and (P1 u, Q1) times the acceleration.
template <class Segments, class Frame, class Forces>
SOFTARM_INLINE void arc_forces(const Segments& k, int l, const Vector3& weight, const Frame& f,
                               Forces& out) noexcept {
  const double ux = k.ux[l], uy = k.uy[l];
  const auto& m = k.arc;
  const Vector3 on_p = acceleration(m.pp[l], m.pq[l], m.pp1[l], m.pq1[l],
                                    k.centre.p[l] * weight + lane(k.own_p, l), f);
  const Vector3 on_q = acceleration(m.pq[l], m.qq[l], m.qp1[l], m.qq1[l],
                                    k.centre.q[l] * weight + lane(k.own_q, l), f);
  const double stretch = k.own_stretch[l] + k.centre.p1[l] * (ux * weight.x + uy * weight.y) +
                         k.centre.q1[l] * weight.z + arc_stretch(k, l, f);
  out.moment = {uy * on_p.z - on_q.y, on_q.x - ux * on_p.z, ux * on_p.y - uy * on_p.x};
  set_torque(ux, uy, on_p.x, on_p.y, stretch, out);
  if constexpr (Segments::kExtensible) out.virial = ux * on_p.x + uy * on_p.y + on_q.z;
}

/// A thick cross-section of radius r turns with the arc.
template <bool kInertia, bool kCoriolis>
void add_rotary_inertia(const SegmentParameters& segment, const double* x, int i,
                        const SegmentLanes& k, const FrameMotion& m, SegmentForces& out) noexcept {
  const int l = lane_of(i);
  const double r = segment.radius_m;
  DiscMotion motion{m.spin_a, m.spin_b, m.angular, k.ux[l], k.uy[l], {}, {}, {}};
  if constexpr (kCoriolis) {
    motion.a = lane(k.a, l);
    motion.b = lane(k.b, l);
  }
  if constexpr (kInertia) {
    motion.x = direction(motion.ux, motion.uy, x[0], x[1]);
  }
  const DiscForces discs = disc_forces(0.25 * segment.mass_kg * r * r, motion);
  out.moment += discs.moment;
  out.torque_x += discs.torque_x;
  out.torque_y += discs.torque_y;
}

template <MassModel kMass, class Segments, class Frame, class Forces>
SOFTARM_INLINE void own_forces(const Segments& k, int l, const Vector3& base, const Frame& f,
                               Forces& out) noexcept {
  const double mass = k.mass[l];
  out.force = mass * acceleration(k.centre.p[l], k.centre.q[l], k.centre.p1[l], k.centre.q1[l],
                                  base + lane(k.own_centre, l), f);
  if constexpr (kMass == MassModel::point) {
    point_forces(k, l, out);
  } else {
    arc_forces(k, l, mass * base, f, out);
  }
}

/// From S_{i-1} to S_i.
template <bool kCoriolis, class Frame>
SOFTARM_INLINE void advance(const SegmentLanes& k, int l, const Frame& f, FrameMotion& m) noexcept {
  const Turn to_next = turn(k, l);
  m.linear = rotate_back(to_next, acceleration(k.tip.p[l], k.tip.q[l], k.tip.p1[l], k.tip.q1[l],
                                               m.linear + lane(k.own_tip, l), f));
  m.angular += lane(k.own_spin, l);
  if constexpr (kCoriolis) {
    const Vector3 a = lane(k.spin_a, l), b = lane(k.spin_b, l);
    if constexpr (!std::is_same_v<Frame, StillFrame>) {
      m.angular += 0.5 * (cross(m.spin_a, b) + cross(m.spin_b, a));
    }
    m.spin_a = rotate_back(to_next, m.spin_a + a);
    m.spin_b = rotate_back(to_next, m.spin_b + b);
  }
  m.angular = rotate_back(to_next, m.angular);
}

template <MassModel kMass, bool kExtensible, bool kInertia, bool kCoriolis>
void outward(const ArmParameters& arm, const Inputs& in, Vector3 base, LanesOf<kExtensible>* lanes,
             ForcesOf<kExtensible>* out) noexcept {
  const int n = arm.size();
  FrameMotion m{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, base};
  const auto add_thickness = [&](int i, const SegmentLanes& k) {
    if constexpr (kMass == MassModel::distributed) {
      const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
      if (segment.radius_m > 0.0) {
        add_rotary_inertia<kInertia, kCoriolis>(segment, in.x + kCoordinates<kExtensible> * i, i, k,
                                                m, out[i]);
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
      if (!last) advance<kCoriolis>(k, l, StillFrame{}, m);
    } else {
      const FrameAcceleration f = frame_acceleration<kCoriolis>(m, k, l);
      own_forces<kMass>(k, l, m.linear, f, out[i]);
      add_thickness(i, k);
      if (!last) advance<kCoriolis>(k, l, f, m);
    }
  }
}

template <bool kExtensible>
void inward(int n, const LanesOf<kExtensible>* lanes, const ForcesOf<kExtensible>* segments,
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
    const double c1 = k.turn_rate.c1[l], twist = k.turn_rate.c2[l] * moment.z;
    const double stretch = k.tip.p1[l] * (ux * force.x + uy * force.y) + k.tip.q1[l] * force.z +
                           k.turn_rate.c3[l] * (ux * moment.y - uy * moment.x);
    out[kWidth * i] = own.torque_x + p * force.x + c1 * moment.y + stretch * ux - twist * uy;
    out[kWidth * i + 1] = own.torque_y + p * force.y - c1 * moment.x + stretch * uy + twist * ux;
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
using Outward = void (*)(const ArmParameters&, const Inputs&, Vector3, LanesOf<kExtensible>*,
                         ForcesOf<kExtensible>*) noexcept;

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
