// B x + C(u, a) b + G by one pass from base to tip and one back (Newton-Euler), bilinear in a and
// b.
//
// Everything is written in the local frames S_{i-1}; no far origin is ever used, so long chains and
// unequal segments keep their digits. Outward, the second derivative of the frames along a and b is
// carried: D_a D_b R = M R with M = [alpha]x + ([w_a]x [w_b]x + [w_b]x [w_a]x) / 2. What B adds,
// the first derivative along x, enters the same two places, and gravity is an acceleration of the
// base. What a segment does within its own frame depends on no other: four segments at a time
// (segment_lanes.hpp).
#include <Eigen/Core>
#include <type_traits>

#include "model/dynamics_storage.hpp"
#include "model/rotary_inertia.hpp"
#include "softarm/model/dynamics.hpp"

// In line at both of its places, for the base and for a moving frame: g++ would leave one a call.
#define SOFTARM_INLINE [[gnu::always_inline]] inline

namespace softarm {
namespace {

/// Inputs of inverse_dynamics, 2n numbers each.
struct Inputs {
  const double* u;
  const double* a;
  const double* b;
  const double* x;
};

/// Derivative along x, and twice along a and b.
template <bool kInertia, bool kCoriolis, class Coefficients>
Vec3<Lanes> own(const Coefficients& f, const SegmentLanes& k,
                const DirectionOf<Lanes>& x) noexcept {
  if constexpr (kInertia && kCoriolis) {
    return second(f, k.ux, k.uy, k.a, k.b) + first(f, k.ux, k.uy, x);
  }
  if constexpr (kCoriolis) return second(f, k.ux, k.uy, k.a, k.b);
  return first(f, k.ux, k.uy, x);
}

/// The arc's acceleration within its frame is P x + P1 g + P2 kappa u in the plane and Q1 beta + Q2
/// kappa along z.
void own_arc(const DirectionOf<Lanes>& x, SegmentLanes& k) noexcept {
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

/// What segments `begin` ... `begin + 3` do within their own frames; lanes beyond the last segment
/// are straight and weigh nothing.
template <MassModel kMass, bool kInertia, bool kCoriolis>
void prepare(const ArmParameters& arm, const Inputs& in, int begin, SegmentLanes& k) noexcept {
  constexpr bool kArc = kMass == MassModel::distributed && (kInertia || kCoriolis);
  const int count = arm.size() - begin;
  k.ux = load(in.u + 2 * begin, 2, count);
  k.uy = load(in.u + 2 * begin + 1, 2, count);
  set_shape<kArc>(arm, begin, k);
  DirectionOf<Lanes> x{};
  if constexpr (kInertia) x = load_direction(in.x + 2 * begin, count, k);
  if constexpr (kCoriolis) {
    k.a = load_direction(in.a + 2 * begin, count, k);
    k.b = load_direction(in.b + 2 * begin, count, k);
    k.spin_a = first(k.turn_rate, k.ux, k.uy, k.a);
    k.spin_b = first(k.turn_rate, k.ux, k.uy, k.b);
  } else if constexpr (kArc) {
    k.a = k.b = DirectionOf<Lanes>{};
  }
  if constexpr (kInertia || kCoriolis) {
    k.own_tip = own<kInertia, kCoriolis>(k.tip, k, x);
    k.own_centre = own<kInertia, kCoriolis>(k.centre, k, x);
    k.own_spin = own<kInertia, kCoriolis>(k.turn_rate, k, x);
  }
  if constexpr (kArc) own_arc(x, k);
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

template <bool kCoriolis>
SOFTARM_INLINE FrameAcceleration frame_acceleration(const FrameMotion& m, const SegmentLanes& k,
                                                    int l) noexcept {
  const double ux = k.ux[l], uy = k.uy[l];
  const Vector3& al = m.angular;
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

/// All mass in the centre. Gravity alone does the same to an arc.
inline void point_forces(const SegmentLanes& k, int l, SegmentForces& out) noexcept {
  const double ux = k.ux[l], uy = k.uy[l], p = k.centre.p[l];
  const Vector3& F = out.force;
  out.moment = cross(Vector3{p * ux, p * uy, k.centre.q[l]}, F);
  set_torque(ux, uy, p * F.x, p * F.y,
             k.centre.p1[l] * (ux * F.x + uy * F.y) + k.centre.q1[l] * F.z, out);
}

/// Mass along the arc: the integrals of P, Q and (P1 u, Q1) times the acceleration.
template <class Frame>
SOFTARM_INLINE void arc_forces(const SegmentLanes& k, int l, const Vector3& weight, const Frame& f,
                               SegmentForces& out) noexcept {
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
}

/// A thick cross-section of radius r turns with the arc.
template <bool kInertia, bool kCoriolis>
void add_rotary_inertia(const SegmentParameters& segment, const Inputs& in, int i,
                        const SegmentLanes& k, const FrameMotion& m, SegmentForces& out) noexcept {
  const int l = i % kLanes;
  const double r = segment.radius_m;
  DiscMotion motion{m.spin_a, m.spin_b, m.angular, k.ux[l], k.uy[l], {}, {}, {}};
  if constexpr (kCoriolis) {
    motion.a = lane(k.a, l);
    motion.b = lane(k.b, l);
  }
  if constexpr (kInertia) {
    motion.x = direction(motion.ux, motion.uy, in.x[2 * i], in.x[2 * i + 1]);
  }
  const DiscForces discs = disc_forces(0.25 * segment.mass_kg * r * r, motion);
  out.moment += discs.moment;
  out.torque_x += discs.torque_x;
  out.torque_y += discs.torque_y;
}

template <MassModel kMass, class Frame>
SOFTARM_INLINE void own_forces(const SegmentLanes& k, int l, const Vector3& base, const Frame& f,
                               SegmentForces& out) noexcept {
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

template <MassModel kMass, bool kInertia, bool kCoriolis>
void outward(const ArmParameters& arm, const Inputs& in, Vector3 base, SegmentLanes* lanes,
             SegmentForces* out) noexcept {
  const int n = arm.size();
  FrameMotion m{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, base};
  const auto add_thickness = [&](int i, const SegmentLanes& k) {
    if constexpr (kMass == MassModel::distributed) {
      const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
      if (segment.radius_m > 0.0) {
        add_rotary_inertia<kInertia, kCoriolis>(segment, in, i, k, m, out[i]);
      }
    }
  };
  for (int i = 0; i < n; ++i) {
    SegmentLanes& k = lanes[i / kLanes];
    const int l = i % kLanes;
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

void inward(int n, const SegmentLanes* lanes, const SegmentForces* segments, double* out) noexcept {
  const SegmentForces& last = segments[n - 1];
  out[2 * n - 2] = last.torque_x;
  out[2 * n - 1] = last.torque_y;
  // Lanes of a Pair: force and moment (about p_i) of everything beyond p_i.
  PairVector3 beyond = side_by_side(last.force, last.moment);
  for (int i = n - 2; i >= 0; --i) {
    const SegmentLanes& k = lanes[i / kLanes];
    const int l = i % kLanes;
    const SegmentForces& own = segments[i];
    beyond = rotate(turn(k, l), beyond);
    const Vector3 force = column(beyond, 0), moment = column(beyond, 1);
    const double ux = k.ux[l], uy = k.uy[l], p = k.tip.p[l];
    const double c1 = k.turn_rate.c1[l], twist = k.turn_rate.c2[l] * moment.z;
    const double stretch = k.tip.p1[l] * (ux * force.x + uy * force.y) + k.tip.q1[l] * force.z +
                           k.turn_rate.c3[l] * (ux * moment.y - uy * moment.x);
    out[2 * i] = own.torque_x + p * force.x + c1 * moment.y + stretch * ux - twist * uy;
    out[2 * i + 1] = own.torque_y + p * force.y - c1 * moment.x + stretch * uy + twist * ux;
    if (i == 0) return;
    const Vector3 lever = cross(Vector3{p * ux, p * uy, k.tip.q[l]}, force);
    beyond += side_by_side(own.force, own.moment + lever);
  }
}

template <MassModel kMass>
void outward(const ArmParameters& arm, const Inputs& in, const DynamicsTerms& terms,
             const Vector3& base, DynamicsWorkspace::Storage& s) noexcept {
  const auto run =
      terms.inertia ? (terms.coriolis ? outward<kMass, true, true> : outward<kMass, true, false>)
                    : (terms.coriolis ? outward<kMass, false, true> : outward<kMass, false, false>);
  run(arm, in, base, s.lanes.data(), s.forces.data());
}

}  // namespace

void inverse_dynamics(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                      ConstVectorRef velocity_a, ConstVectorRef velocity_b,
                      ConstVectorRef acceleration, DynamicsTerms terms, VectorRef out) noexcept {
  auto& s = workspace.storage();
  const Inputs in{u.data(), velocity_a.data(), velocity_b.data(), acceleration.data()};
  Vector3 base{0, 0, 0};
  if (terms.gravity) base = from_eigen(-(arm.base_rotation.transpose() * arm.gravity_mps2));
  if (arm.mass == MassModel::point) {
    outward<MassModel::point>(arm, in, terms, base, s);
  } else {
    outward<MassModel::distributed>(arm, in, terms, base, s);
  }
  inward(arm.size(), s.lanes.data(), s.forces.data(), out.data());
}

}  // namespace softarm
