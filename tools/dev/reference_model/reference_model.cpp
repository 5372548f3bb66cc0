#include "dev/reference_model/reference_model.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <map>

#include "dev/reference_model/reference_dual.hpp"

namespace softarm::reference {
namespace {

/// c_k and its derivatives by s, all as duals of s.
struct Functions {
  std::array<Dual, 8> c;      ///< c_0 ... c_7
  std::array<Dual, 4> slope;  ///< dc_k/ds, k = 0 ... 3

  explicit Functions(Dual s) {
    const auto f = entire_functions(s.v);
    const auto slope_of = [&f](std::size_t k) {
      return (static_cast<Real>(k) * f[k + 2] - f[k + 1]) / 2;
    };
    for (std::size_t k = 0; k < c.size(); ++k) c[k] = {f[k], slope_of(k) * s.d};
    for (std::size_t k = 0; k < slope.size(); ++k) {
      slope[k] = Real(0.5) * (static_cast<Real>(k) * c[k + 2] - c[k + 1]);
    }
  }
};

/// Columns of one segment along u_x, u_y and its length; the last is only for arms that stretch.
using Columns = std::array<Triple, 3>;

/// A piece of arc of length L bent by u, in the axes of its base.
struct Piece {
  Rotation R;
  Triple tip;
  Columns tip_column;
  Columns angular_column;  ///< omega for unit rates
};

Piece piece(Dual length, Dual ux, Dual uy) {
  const Functions f(ux * ux + uy * uy);
  const auto& c = f.c;
  const std::array<Dual, 2> u{ux, uy};
  const Dual one{1, 0};
  Piece p;
  p.R = {Triple{one - c[2] * ux * ux, -(c[2] * ux * uy), c[1] * ux},
         Triple{-(c[2] * ux * uy), one - c[2] * uy * uy, c[1] * uy},
         Triple{-(c[1] * ux), -(c[1] * uy), c[0]}};
  p.tip = {length * (c[2] * ux), length * (c[2] * uy), length * c[1]};
  for (std::size_t a = 0; a < 2; ++a) {
    const Dual stretch = Real(2) * (f.slope[2] * u[a]);
    p.tip_column[a] = {length * (stretch * ux), length * (stretch * uy),
                       Real(2) * (length * (f.slope[1] * u[a]))};
    p.tip_column[a][a] = p.tip_column[a][a] + length * c[2];
    // c1 w' + c3 w (w.w') and c2 (u1 u2' - u2 u1') for u' = e_a, w = (-u2, u1).
    const Dual turn = c[3] * u[a];
    p.angular_column[a] = {-(turn * uy), turn * ux, a == 0 ? -(c[2] * uy) : c[2] * ux};
    p.angular_column[a][a == 0 ? 1 : 0] =
        p.angular_column[a][a == 0 ? 1 : 0] + (a == 0 ? c[1] : -c[1]);
  }
  p.tip_column[2] = {c[2] * ux, c[2] * uy, c[1]};
  return p;
}

/// The centre of mass of an arc, L (c3 u, c2), and its columns.
struct Centre {
  Triple point;
  Columns column;
};

Centre centre(Dual length, Dual ux, Dual uy) {
  const Functions f(ux * ux + uy * uy);
  const std::array<Dual, 2> u{ux, uy};
  Centre m{{length * (f.c[3] * ux), length * (f.c[3] * uy), length * f.c[2]}, {}};
  for (std::size_t a = 0; a < 2; ++a) {
    const Dual stretch = Real(2) * (f.slope[3] * u[a]);
    m.column[a] = {length * (stretch * ux), length * (stretch * uy),
                   Real(2) * (length * (f.slope[2] * u[a]))};
    m.column[a][a] = m.column[a][a] + length * f.c[3];
  }
  m.column[2] = {f.c[3] * ux, f.c[3] * uy, f.c[2]};
  return m;
}

/// A segment with its base's axes and its columns in the axes of the whole arm's base.
struct Segment {
  Dual ux, uy, length;
  Rotation base;
  Triple tip;
  Columns tip_column, angular_column;
};

struct Arm {
  std::size_t width;  ///< coordinates a segment
  std::vector<Segment> segments;
  Rotation end;  ///< of the last segment

  Arm(const ArmParameters& arm, const Vector& u, const Vector& velocity)
      : width(static_cast<std::size_t>(arm.segment_dof())), end(constant(Matrix3::Identity())) {
    for (int i = 0; i < arm.size(); ++i) {
      const int first = arm.segment_dof() * i;
      Segment s;
      s.ux = {u(first), velocity(first)};
      s.uy = {u(first + 1), velocity(first + 1)};
      s.length = {arm.segments[static_cast<std::size_t>(i)].length_m, 0};
      if (arm.extensible) s.length = s.length + Dual{u(first + 2), velocity(first + 2)};
      s.base = end;
      const Piece p = piece(s.length, s.ux, s.uy);
      s.tip = end * p.tip;
      for (std::size_t a = 0; a < width; ++a) {
        s.tip_column[a] = end * p.tip_column[a];
        s.angular_column[a] = end * p.angular_column[a];
      }
      segments.push_back(s);
      end = end * p.R;
    }
  }

  /// Columns of all ancestors of segment m for a point at `lever` from its base. The lever grows
  /// from the nearest segment, so that unequal lengths lose nothing.
  void ancestors(std::size_t m, Triple lever, std::vector<Triple>& columns) const {
    for (std::size_t j = m; j-- > 0;) {
      for (std::size_t a = 0; a < width; ++a) {
        columns[width * j + a] =
            cross(segments[j].angular_column[a], lever) + segments[j].tip_column[a];
      }
      lever = lever + segments[j].tip;
    }
  }
};

/// Adds one mass point that has `dof` columns.
void add_mass(Real mass, std::size_t dof, const std::vector<Triple>& columns, const Vector3& g,
              Dynamics& out) {
  for (std::size_t i = 0; i < dof; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Triple& J = columns[i];
    for (std::size_t j = 0; j < dof; ++j) {
      const auto col = static_cast<Eigen::Index>(j);
      if (j >= i) out.B(row, col) += mass * dot(J, columns[j]);
      out.C(row, col) += mass * dot_rate(J, columns[j]);
    }
    out.G(row) -= mass * (J[0].v * g(0) + J[1].v * g(1) + J[2].v * g(2));
    out.r(row) += mass * (J[0].d * J[0].d + J[1].d * J[1].d + J[2].d * J[2].d);
  }
}

/// The masses of one segment, one after the other.
class SegmentMasses {
 public:
  SegmentMasses(const Arm& arm, const Vector3& gravity, Dynamics& out)
      : arm_(arm), gravity_(gravity), out_(out), columns_(arm.width * arm.segments.size()) {}

  void point(std::size_t m, Real mass) {
    const Segment& s = arm_.segments[m];
    const Centre c = centre(s.length, s.ux, s.uy);
    add(m, mass, c.point, c.column);
  }

  void node(std::size_t m, Real mass, Real x, Real radius) {
    const Segment& s = arm_.segments[m];
    // The first x of an arc is an arc of length x l bent by x u.
    const Piece p = piece(x * s.length, x * s.ux, x * s.uy);
    if (radius == 0) {
      add(m, mass, p.tip, {x * p.tip_column[0], x * p.tip_column[1], x * p.tip_column[2]});
      return;
    }
    const Real ring = radius / std::sqrt(Real(2));
    for (const auto& [dx, dy] : {std::array<Real, 2>{ring, 0}, {-ring, 0}, {0, ring}, {0, -ring}}) {
      const Triple offset = p.R * Triple{Dual{dx, 0}, Dual{dy, 0}, Dual{}};
      Columns own;
      for (std::size_t a = 0; a < own.size(); ++a) {
        own[a] = x * (p.tip_column[a] + cross(p.angular_column[a], offset));
      }
      add(m, mass / 4, p.tip + offset, own);
    }
  }

 private:
  /// A mass at `lever` from the base of segment m, in the segment's axes.
  void add(std::size_t m, Real mass, const Triple& lever, const Columns& own) {
    const std::size_t first = arm_.width * m;
    const Rotation& base = arm_.segments[m].base;
    for (std::size_t a = 0; a < arm_.width; ++a) columns_[first + a] = base * own[a];
    arm_.ancestors(m, base * lever, columns_);
    add_mass(mass, first + arm_.width, columns_, gravity_, out_);
  }

  const Arm& arm_;
  const Vector3& gravity_;
  Dynamics& out_;
  std::vector<Triple> columns_;
};

/// Nodes that integrate products of two derivatives of an arc bent by theta to 1e-20.
int nodes_for(Real theta) { return 12 + static_cast<int>(std::ceil(2 * theta)); }

Quadrature make_gauss_legendre(int order) {
  Quadrature rule;
  for (int i = 0; i < order; ++i) {
    Real x = std::cos(std::acos(Real(-1)) * (i + 0.75L) / (order + 0.5L)), slope = 1;
    for (int iteration = 0; iteration < 30; ++iteration) {
      Real previous = 1, value = x;
      for (int k = 2; k <= order; ++k) {
        const Real next = ((2 * k - 1) * x * value - (k - 1) * previous) / k;
        previous = value;
        value = next;
      }
      slope = order * (x * value - previous) / (x * x - 1);
      x -= value / slope;
    }
    rule.node.push_back((1 + x) / 2);
    rule.weight.push_back(1 / ((1 - x * x) * slope * slope));
  }
  return rule;
}

}  // namespace

std::array<Real, 12> entire_functions(Real s) {
  static const std::array<Real, 70> inverse_factorial = [] {
    std::array<Real, 70> inverse{1};
    for (std::size_t k = 1; k < inverse.size(); ++k) {
      inverse[k] = inverse[k - 1] / static_cast<Real>(k);
    }
    return inverse;
  }();
  std::array<Real, 12> c{};
  if (s < 64) {
    const std::size_t terms = s < 1 ? 11 : s < 16 ? 20 : 29;  // the first left out is below 1e-21
    for (std::size_t k = 0; k < c.size(); ++k) {
      for (std::size_t j = terms; j-- > 0;) c[k] = inverse_factorial[k + 2 * j] - s * c[k];
    }
    return c;
  }
  const Real theta = std::sqrt(s);
  c[0] = std::cos(theta);
  c[1] = std::sin(theta) / theta;
  for (std::size_t k = 0; k + 2 < c.size(); ++k) c[k + 2] = (inverse_factorial[k] - c[k]) / s;
  return c;
}

const Quadrature& gauss_legendre(int order) {
  thread_local std::map<int, Quadrature> known;
  const auto [entry, is_new] = known.try_emplace(order);
  if (is_new) entry->second = make_gauss_legendre(order);
  return entry->second;
}

Kinematics kinematics(const ArmParameters& arm, const Vector& u, const Vector& velocity) {
  // In the axes of S_0 first: the base's rotation need not be orthogonal to more than a double.
  const Matrix3 base = arm.base_rotation.cast<Real>();
  const Arm chain(arm, u, velocity);
  const auto n = chain.segments.size();
  Kinematics out;
  out.centres.resize(3, arm.size());
  out.jacobian.resize(3, arm.dof());
  out.jacobian_rate.resize(3, arm.dof());
  out.angular_jacobian.resize(3, arm.dof());
  Vector3 position = arm.base_position_m.cast<Real>();
  for (std::size_t i = 0; i < n; ++i) {
    const Segment& s = chain.segments[i];
    const Centre own = centre(s.length, s.ux, s.uy);
    out.centres.col(static_cast<Eigen::Index>(i)) = position + base * values(s.base * own.point);
    position += base * values(s.tip);
    out.positions.push_back(position);
    out.rotations.push_back(base * values(i + 1 < n ? chain.segments[i + 1].base : chain.end));
  }
  std::vector<Triple> columns(chain.width * n);
  chain.ancestors(n, Triple{}, columns);
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const auto col = static_cast<Eigen::Index>(k);
    out.jacobian.col(col) = base * values(columns[k]);
    out.jacobian_rate.col(col) = base * rates(columns[k]);
    out.angular_jacobian.col(col) =
        base * values(chain.segments[k / chain.width].angular_column[k % chain.width]);
  }
  return out;
}

Dynamics dynamics(const ArmParameters& arm, const Vector& u, const Vector& velocity,
                  int extra_nodes) {
  const int dof = arm.dof();
  const Vector3 gravity =
      arm.base_rotation.cast<Real>().transpose() * arm.gravity_mps2.cast<Real>();
  Dynamics out;
  out.B = out.C = Matrix::Zero(dof, dof);
  out.G = out.s = out.r = Vector::Zero(dof);
  const Arm chain(arm, u, velocity);
  SegmentMasses masses(chain, gravity, out);
  Real total = 0;
  for (std::size_t m = 0; m < chain.segments.size(); ++m) {
    const Real mass = arm.segments[m].mass_kg;
    total += mass;
    if (arm.mass == MassModel::point) {
      masses.point(m, mass);
      continue;
    }
    const Segment& s = chain.segments[m];
    const Quadrature& rule = gauss_legendre(nodes_for(std::hypot(s.ux.v, s.uy.v)) + extra_nodes);
    for (std::size_t k = 0; k < rule.node.size(); ++k) {
      masses.node(m, mass * rule.weight[k], rule.node[k],
                  static_cast<Real>(arm.segments[m].radius_m));
    }
  }
  for (int i = 0; i < dof; ++i) {
    for (int j = 0; j < i; ++j) out.B(i, j) = out.B(j, i);
    out.s(i) = std::sqrt(out.B(i, i));
    out.r(i) = std::sqrt(out.r(i));
  }
  out.w = std::sqrt(total) * gravity.norm();
  out.kinetic_energy = velocity.dot(out.B * velocity) / 2;
  const Matrix3X centres = kinematics(arm, u, velocity).centres;
  const Vector3 weight = arm.gravity_mps2.cast<Real>();
  Real reach = arm.base_position_m.cast<Real>().norm();
  for (int i = 0; i < arm.size(); ++i) {
    const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
    reach += chain.segments[static_cast<std::size_t>(i)].length.v;
    out.gravity_potential -= segment.mass_kg * weight.dot(centres.col(i));
    out.potential_scale += segment.mass_kg * weight.norm() * reach;
  }
  return out;
}

Vector inverse_dynamics(const Dynamics& terms, const Vector& b, const Vector& x) {
  return terms.B * x + terms.C * b + terms.G;
}

Vector inverse_dynamics_scale(const Dynamics& terms, const Vector& b, const Vector& x) {
  return terms.s * (terms.s.dot(x.cwiseAbs()) + terms.r.dot(b.cwiseAbs()) + terms.w);
}

Vector impedance(const ArmParameters& arm, const Vector& u, const Vector& velocity) {
  Vector out(arm.dof());
  for (int i = 0; i < arm.dof(); ++i) {
    const SegmentParameters& s = arm.segments[static_cast<std::size_t>(i / arm.segment_dof())];
    const bool axial = i % arm.segment_dof() == 2;
    out(i) = Real(axial ? s.axial_stiffness_n_per_m : s.stiffness_nm_per_rad) * u(i) +
             Real(axial ? s.axial_damping_ns_per_m : s.damping_nms_per_rad) * velocity(i);
  }
  return out;
}

Vector forward_dynamics(const ArmParameters& arm, const Dynamics& terms, const Vector& u,
                        const Vector& velocity, const Vector& generalized_force) {
  const Vector inverse = terms.s.cwiseInverse();
  const Matrix scaled = inverse.asDiagonal() * terms.B * inverse.asDiagonal();
  const Eigen::LLT<Matrix> factor(scaled);
  if (factor.info() != Eigen::Success) {
    return Vector::Constant(arm.dof(), std::numeric_limits<Real>::quiet_NaN());
  }
  const Vector rhs = generalized_force - terms.C * velocity - terms.G - impedance(arm, u, velocity);
  return inverse.cwiseProduct(Vector(factor.solve(inverse.cwiseProduct(rhs))));
}

}  // namespace softarm::reference
