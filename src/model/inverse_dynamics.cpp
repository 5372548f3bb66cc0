// B x + C(u, a) b + G by one pass from base to tip and one back (Newton-Euler), bilinear in a and
// b.
//
// Everything is written in the local frames S_{i-1}; no far origin is ever used, so long chains and
// unequal segments keep their digits. Outward, the second derivative of the frames along a and b is
// carried: D_a D_b R = ([alpha]x +
// ([w_a]x [w_b]x + [w_b]x [w_a]x) / 2) R. What B adds, the first derivative along x, enters the
// same two places, and gravity is an acceleration of the base.
#include <Eigen/Core>

#include "model/arc_moments.hpp"
#include "model/dynamics_storage.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {
namespace {

/// Motion of the frame S_{i-1}, in its own coordinates.
struct FrameMotion {
  Vector3 spin_a, spin_b;   ///< angular velocity along a, b
  Vector3 angular, linear;  ///< alpha and D_a D_b p - g, what x does included
};

struct Inputs {
  const double* u;
  const double* a;
  const double* b;
  const double* x;
};

/// ([w_a]x [w_b]x + [w_b]x [w_a]x) r / 2: the centripetal part for the bilinear product.
inline Vector3 centripetal(const FrameMotion& m, double ab, const Vector3& r) noexcept {
  return (0.5 * dot(m.spin_b, r)) * m.spin_a + (0.5 * dot(m.spin_a, r)) * m.spin_b - ab * r;
}

template <bool kInertia, bool kCoriolis>
struct Along {
  Direction a{}, b{}, x{};

  Along(const Inputs& in, int i, double ux, double uy) noexcept {
    if constexpr (kCoriolis) {
      a = direction(ux, uy, in.a[2 * i], in.a[2 * i + 1]);
      b = direction(ux, uy, in.b[2 * i], in.b[2 * i + 1]);
    }
    if constexpr (kInertia) x = direction(ux, uy, in.x[2 * i], in.x[2 * i + 1]);
  }

  /// Derivative that does not come from the frame's own motion: along x, and twice along a and b.
  template <class Coefficients>
  Vector3 own(const Coefficients& f, double ux, double uy) const noexcept {
    if constexpr (kInertia && kCoriolis) return second(f, ux, uy, a, b) + first(f, ux, uy, x);
    if constexpr (kCoriolis) return second(f, ux, uy, a, b);
    return first(f, ux, uy, x);
  }
};

/// Acceleration of a point of the segment whose motion within S_{i-1} the curve f describes.
template <bool kInertia, bool kCoriolis>
inline Vector3 acceleration(const FrameMotion& m, double spin_ab, const Curve& f, double ux,
                            double uy, const Along<kInertia, kCoriolis>& along,
                            const Vector3& r) noexcept {
  Vector3 result = m.linear;
  if constexpr (kInertia || kCoriolis) result += cross(m.angular, r) + along.own(f, ux, uy);
  if constexpr (kCoriolis) {
    result += centripetal(m, spin_ab, r) + cross(m.spin_a, first(f, ux, uy, along.b)) +
              cross(m.spin_b, first(f, ux, uy, along.a));
  }
  return result;
}

/// Distributed mass: what the arc's motion about its base adds to moment and torque.
template <bool kInertia, bool kCoriolis>
inline void add_arc_forces(const SegmentParameters& segment, const std::array<double, 12>& c,
                           const FrameMotion& m, double spin_ab,
                           const Along<kInertia, kCoriolis>& along, SegmentForces& out) noexcept {
  const double ux = out.ux, uy = out.uy, s = ux * ux + uy * uy;
  const double scale = segment.mass_kg * segment.length_m * segment.length_m;
  const ArcMoments moments = arc_moments(scale, s, c);
  const Direction &a = along.a, &b = along.b, &x = along.x;
  const double beta = a.x * b.x + a.y * b.y + x.along;
  const ArcMotion motion{x.x,
                         x.y,
                         b.along * a.x + a.along * b.x + beta * ux,
                         b.along * a.y + a.along * b.y + beta * uy,
                         beta,
                         a.along * b.along,
                         x.along};
  const auto add = [&out](const ArcForces& f) {
    out.moment += f.moment;
    out.torque += f.torque;
  };
  add(relative_motion_forces(moments, ux, uy, s, motion));
  add(angular_forces(moments, ux, uy, s, m.angular));
  if constexpr (kCoriolis) {
    add(centripetal_forces(moments, ux, uy, s, m.spin_a, m.spin_b, spin_ab));
    add(coriolis_forces(moments, ux, uy, s, m.spin_a, b));
    add(coriolis_forces(moments, ux, uy, s, m.spin_b, a));
  }
}

template <MassModel kMass, bool kInertia, bool kCoriolis>
inline void own_forces(const SegmentParameters& segment, const auto& c, const FrameMotion& m,
                       double spin_ab, const Along<kInertia, kCoriolis>& along,
                       SegmentForces& out) noexcept {
  const double ux = out.ux, uy = out.uy;
  const Curve centre = centre_curve(segment.length_m, c);
  const Vector3 r = point(centre, ux, uy);
  const double mass = segment.mass_kg;
  out.force = mass * acceleration(m, spin_ab, centre, ux, uy, along, r);
  if constexpr (kMass == MassModel::point || !(kInertia || kCoriolis)) {
    out.moment = cross(r, out.force);
    out.torque = project(centre, ux, uy, out.force);
  } else {
    // The base's acceleration acts on the first moment; the rest needs second moments of the arc.
    const Vector3 uniform = mass * m.linear;
    out.moment = cross(r, uniform);
    out.torque = project(centre, ux, uy, uniform);
    add_arc_forces(segment, c, m, spin_ab, along, out);
  }
}

template <MassModel kMass, bool kInertia, bool kCoriolis>
void outward(const ArmParameters& arm, const Inputs& in, Vector3 base,
             SegmentForces* out) noexcept {
  constexpr int kFunctions = kMass == MassModel::point ? 8 : 12;
  const int n = arm.size();
  FrameMotion m{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, base};
  for (int i = 0; i < n; ++i) {
    const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
    const double ux = in.u[2 * i], uy = in.u[2 * i + 1];
    const auto c = entire<kFunctions>(ux * ux + uy * uy);
    SegmentForces& s = out[i];
    s.ux = ux;
    s.uy = uy;
    s.tip = tip_curve(segment.length_m, c);
    s.turn_rate = spin(c);
    s.turn = {ux, uy, c[0], c[1], c[2]};
    const Along<kInertia, kCoriolis> along(in, i, ux, uy);
    const double spin_ab = kCoriolis ? dot(m.spin_a, m.spin_b) : 0.0;
    own_forces<kMass>(segment, c, m, spin_ab, along, s);
    if (i + 1 == n) return;

    m.linear =
        rotate_back(s.turn, acceleration(m, spin_ab, s.tip, ux, uy, along, point(s.tip, ux, uy)));
    if constexpr (kInertia || kCoriolis) m.angular += along.own(s.turn_rate, ux, uy);
    if constexpr (kCoriolis) {
      const Vector3 a = first(s.turn_rate, ux, uy, along.a);
      const Vector3 b = first(s.turn_rate, ux, uy, along.b);
      m.angular += 0.5 * (cross(m.spin_a, b) + cross(m.spin_b, a));
      m.spin_a = rotate_back(s.turn, m.spin_a + a);
      m.spin_b = rotate_back(s.turn, m.spin_b + b);
    }
    if constexpr (kInertia || kCoriolis) m.angular = rotate_back(s.turn, m.angular);
  }
}

void inward(int n, const SegmentForces* segments, double* out) noexcept {
  Vector3 force{0, 0, 0}, moment{0, 0, 0};  // of everything beyond p_i, about p_i
  for (int i = n - 1; i >= 0; --i) {
    const SegmentForces& s = segments[i];
    force = rotate(s.turn, force);
    moment = rotate(s.turn, moment);
    const Pair torque =
        s.torque + project(s.tip, s.ux, s.uy, force) + project(s.turn_rate, s.ux, s.uy, moment);
    out[2 * i] = torque[0];
    out[2 * i + 1] = torque[1];
    moment += s.moment + cross(point(s.tip, s.ux, s.uy), force);
    force += s.force;
  }
}

template <MassModel kMass>
void outward(const ArmParameters& arm, const Inputs& in, const DynamicsTerms& terms,
             const Vector3& base, SegmentForces* out) noexcept {
  if (terms.inertia && terms.coriolis) return outward<kMass, true, true>(arm, in, base, out);
  if (terms.inertia) return outward<kMass, true, false>(arm, in, base, out);
  if (terms.coriolis) return outward<kMass, false, true>(arm, in, base, out);
  outward<kMass, false, false>(arm, in, base, out);
}

}  // namespace

void inverse_dynamics(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                      ConstVectorRef velocity_a, ConstVectorRef velocity_b,
                      ConstVectorRef acceleration, DynamicsTerms terms, VectorRef out) noexcept {
  SegmentForces* segments = workspace.storage().forces.data();
  const Inputs in{u.data(), velocity_a.data(), velocity_b.data(), acceleration.data()};
  Vector3 base{0, 0, 0};
  if (terms.gravity) base = from_eigen(-(arm.base_rotation.transpose() * arm.gravity_mps2));
  if (arm.mass == MassModel::point) {
    outward<MassModel::point>(arm, in, terms, base, segments);
  } else {
    outward<MassModel::distributed>(arm, in, terms, base, segments);
  }
  inward(arm.size(), segments, out.data());
}

}  // namespace softarm
