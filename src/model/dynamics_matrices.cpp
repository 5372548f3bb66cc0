// B, C and G of the whole arm in O(n^2): one pass outward for every segment's columns, one inward
// that carries the moments of everything beyond and, for each column, hands its momenta down to the
// ancestors.
//
// With J_jb the motion of the mass for unit u'_jb (v_jb + w_jb x y about p_j on everything beyond):
//   B_ia,jb = v_ia . P + w_ia . L,           P = int J_jb,   L = int y x J_jb            (about
//   p_i, over the subtree of j) C_ia,jb = v_ia . P' + w_ia . L',         P' = int J_jb', L' = int y
//   x J_jb' C_jb,ia = v_ia' . P + w_ia' . L + w_ia . F,              F  = int y' x J_jb G_jb = -g .
//   P
// for i <= j. References are always the nearest segment ends, so nothing is the small difference of
// far levers.
#include <algorithm>
#include <array>
#include <cmath>

#include "model/dynamics_storage.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/polar.hpp"

namespace softarm {
namespace {

/// Momenta of a column pair, handed from ancestor to ancestor.
struct ColumnMomenta {
  PairVector3 P, L, P_rate, L_rate, flow;

  template <bool kCoriolis>
  void rotate_by(const Turn& turn) noexcept {
    P = rotate(turn, P);
    L = rotate(turn, L);
    if constexpr (!kCoriolis) return;
    P_rate = rotate(turn, P_rate);
    L_rate = rotate(turn, L_rate);
    flow = rotate(turn, flow);
  }
  template <bool kCoriolis>
  void move_by(const Vector3& t, const Vector3& t_rate) noexcept {
    L += cross(t, P);
    if constexpr (!kCoriolis) return;
    L_rate += cross(t, P_rate);
    flow += cross(t_rate, P);
  }
};

struct Output {
  double* data;
  Eigen::Index stride;

  double& operator()(int row, int col) const noexcept { return data[row + col * stride]; }
};

/// Where the arm is and how it moves, in u or in polar coordinates.
struct State {
  const double* q;
  const double* velocity;
};

/// Columns along phi and theta from those along u_x and u_y: J P with u' = P q', and their rates
/// J' P + J P'.
struct PolarColumns {
  Pair x, y;            ///< rows of P = [[-theta sin phi, cos phi], [theta cos phi, sin phi]]
  Pair x_rate, y_rate;  ///< rows of P'

  PolarColumns() noexcept = default;
  PolarColumns(double phi, double theta, double phi_rate, double theta_rate) noexcept {
    const double c = std::cos(phi), s = std::sin(phi);
    const double turned = theta * phi_rate;
    x = Pair{-theta * s, c};
    y = Pair{theta * c, s};
    x_rate = Pair{-theta_rate * s - turned * c, -phi_rate * s};
    y_rate = Pair{theta_rate * c - turned * s, phi_rate * c};
  }

  Pair times_map(Pair j) const noexcept { return j[0] * x + j[1] * y; }
  Pair times_rate(Pair j) const noexcept { return j[0] * x_rate + j[1] * y_rate; }
  /// `rate` first: it needs the columns in u.
  void apply(PairVector3& J, PairVector3& rate) const noexcept {
    rate = {times_map(rate.x) + times_rate(J.x), times_map(rate.y) + times_rate(J.y),
            times_map(rate.z) + times_rate(J.z)};
    apply(J);
  }
  void apply(PairVector3& J) const noexcept {
    J = {times_map(J.x), times_map(J.y), times_map(J.z)};
  }
  /// P' M P given the rows of M P.
  void project_rows(Pair& first, Pair& second) const noexcept {
    const Pair along_x = first, along_y = second;
    first = x[0] * along_x + y[0] * along_y;
    second = x[1] * along_x + y[1] * along_y;
  }
  void apply(SegmentColumns& k) const noexcept {
    apply(k.translation, k.translation_rate);
    apply(k.rotation, k.rotation_rate);
    OwnColumns& own = k.own;
    apply(own.momentum, own.momentum_rate);
    apply(own.angular, own.angular_rate);
    apply(own.flow);
    own.coriolis_x = times_map(own.coriolis_x) + times_rate(own.inertia_x);
    own.coriolis_y = times_map(own.coriolis_y) + times_rate(own.inertia_y);
    project_rows(own.coriolis_x, own.coriolis_y);
    own.inertia_x = times_map(own.inertia_x);
    own.inertia_y = times_map(own.inertia_y);
    project_rows(own.inertia_x, own.inertia_y);
  }
};

/// Four segments in u: what `outward` starts from.
struct SegmentStates {
  ShapeLanes shape;
  DirectionOf<Lanes> velocity;
  std::array<PolarColumns, kLanes> polar;  ///< only where the coordinates are
};

template <bool kArc>
void load_u(const ArmParameters& arm, int begin, const double* u, const double* rate,
            SegmentStates& out) noexcept {
  const int count = arm.size() - begin;
  out.shape.ux = load(u, 2, count);
  out.shape.uy = load(u + 1, 2, count);
  set_shape<kArc>(arm, begin, out.shape);
  out.velocity = load_direction(rate, count, out.shape);
}

template <bool kArc>
void load_polar(const ArmParameters& arm, int begin, const double* q, const double* rate,
                SegmentStates& out) noexcept {
  double u[2 * kLanes], u_rate[2 * kLanes];
  const int count = std::min(arm.size() - begin, kLanes);
  for (int l = 0; l < count; ++l) {
    const double phi = q[2 * l], theta = q[2 * l + 1];
    const double phi_rate = rate[2 * l], theta_rate = rate[2 * l + 1];
    const PolarColumns P(phi, theta, phi_rate, theta_rate);
    u[2 * l] = theta * P.x[1];
    u[2 * l + 1] = theta * P.y[1];
    u_rate[2 * l] = P.x[0] * phi_rate + P.x[1] * theta_rate;
    u_rate[2 * l + 1] = P.y[0] * phi_rate + P.y[1] * theta_rate;
    out.polar[static_cast<std::size_t>(l)] = P;
  }
  load_u<kArc>(arm, begin, u, u_rate, out);
}

template <MassModel kMass, bool kPolar>
void outward(const ArmParameters& arm, const State& state, SegmentColumns* out,
             Vector3 gravity) noexcept {
  constexpr bool kArc = kMass == MassModel::distributed;
  SegmentStates states;
  const ShapeLanes& lanes = states.shape;
  Vector3 spin_of_frame{0, 0, 0};
  for (int i = 0; i < arm.size(); ++i) {
    const int l = i % kLanes;
    if (l == 0) {
      constexpr auto load_states = kPolar ? load_polar<kArc> : load_u<kArc>;
      load_states(arm, i, state.q + 2 * i, state.velocity + 2 * i, states);
    }
    const double ux = lanes.ux[l], uy = lanes.uy[l];
    const Curve tip = lane(lanes.tip, l), centre = lane(lanes.centre, l);
    const Spin rotation = lane(lanes.turn_rate, l);
    const Direction v = lane(states.velocity, l);
    SegmentColumns& k = out[i];
    k.turn = turn(lanes, l);
    k.gravity = gravity;
    k.tip = point(tip, ux, uy);
    k.tip_rate = first(tip, ux, uy, v) + cross(spin_of_frame, k.tip);
    k.translation = columns(tip, ux, uy);
    k.rotation = columns(rotation, ux, uy);
    k.translation_rate = column_rates(tip, ux, uy, v) + cross(spin_of_frame, k.translation);
    k.rotation_rate = column_rates(rotation, ux, uy, v) + cross(spin_of_frame, k.rotation);
    k.mass = lanes.mass[l];
    const OwnState own{ux, uy, k.mass, v, spin_of_frame};
    if constexpr (kArc) {
      k.own = arc_columns(own, centre, lane(lanes.arc, l));
    } else {
      k.own = point_columns(own, centre);
    }
    if constexpr (kPolar) states.polar[static_cast<std::size_t>(l)].apply(k);
    spin_of_frame = rotate_back(k.turn, spin_of_frame + first(rotation, ux, uy, v));
    gravity = rotate_back(k.turn, gravity);
  }
}

/// Column pair j over everything beyond p_j, about p_j.
template <bool kCoriolis>
ColumnMomenta beyond(const SegmentColumns& k, const Composite& body) noexcept {
  const Vector3 h = column(body.first, 0), h_rate = column(body.first, 1);
  const SecondMoments position(body.second, 0), mixed(body.second, 1);
  ColumnMomenta m;
  m.P = body.mass * k.translation - cross(h, k.rotation);
  m.L = cross(h, k.translation) + position.off_trace(k.rotation);
  if constexpr (!kCoriolis) return m;
  m.P_rate = body.mass * k.translation_rate - cross(h, k.rotation_rate) - cross(h_rate, k.rotation);
  m.L_rate = cross(h, k.translation_rate) + position.off_trace(k.rotation_rate) +
             mixed.off_trace_transposed(k.rotation);
  m.flow = cross(h_rate, k.translation) + mixed.off_trace(k.rotation);
  return m;
}

template <bool kCoriolis>
void write_diagonal(int j, const SegmentColumns& k, const ColumnMomenta& m, const Output& B,
                    const Output& C) noexcept {
  for (int a = 0; a < 2; ++a) {
    const Vector3 v = column(k.translation, a), w = column(k.rotation, a);
    const Pair inertia = dot(v, m.P) + dot(w, m.L) + (a == 0 ? k.own.inertia_x : k.own.inertia_y);
    for (int b = a; b < 2; ++b) {  // one triangle decides both: B is symmetric to the last bit
      B(2 * j + a, 2 * j + b) = B(2 * j + b, 2 * j + a) = inertia[b];
    }
    if constexpr (!kCoriolis) continue;
    const Pair coriolis =
        dot(v, m.P_rate) + dot(w, m.L_rate) + (a == 0 ? k.own.coriolis_x : k.own.coriolis_y);
    for (int b = 0; b < 2; ++b) C(2 * j + a, 2 * j + b) = coriolis[b];
  }
}

template <bool kCoriolis>
void write_pair(int i, int j, const SegmentColumns& k, const ColumnMomenta& m, const Output& B,
                const Output& C) noexcept {
  for (int a = 0; a < 2; ++a) {
    const Vector3 v = column(k.translation, a), w = column(k.rotation, a);
    const Pair inertia = dot(v, m.P) + dot(w, m.L);
    for (int b = 0; b < 2; ++b) {
      B(2 * i + a, 2 * j + b) = B(2 * j + b, 2 * i + a) = inertia[b];
    }
    if constexpr (!kCoriolis) continue;
    const Pair upper = dot(v, m.P_rate) + dot(w, m.L_rate);
    const Pair lower = dot(column(k.translation_rate, a), m.P) +
                       dot(column(k.rotation_rate, a), m.L) + dot(w, m.flow);
    for (int b = 0; b < 2; ++b) {
      C(2 * i + a, 2 * j + b) = upper[b];
      C(2 * j + b, 2 * i + a) = lower[b];
    }
  }
}

template <bool kCoriolis>
void inward(int n, const SegmentColumns* segments, const Output& B, const Output& C,
            double* G) noexcept {
  Composite body;
  for (int j = n - 1; j >= 0; --j) {
    const SegmentColumns& k = segments[j];
    body.rotate_by(k.turn);
    ColumnMomenta m = beyond<kCoriolis>(k, body);
    write_diagonal<kCoriolis>(j, k, m, B, C);
    m.move_by<kCoriolis>(k.tip, k.tip_rate);
    m.P += k.own.momentum;
    m.L += k.own.angular;
    if constexpr (kCoriolis) {
      m.P_rate += k.own.momentum_rate;
      m.L_rate += k.own.angular_rate;
      m.flow += k.own.flow;
    }
    const Pair weight = dot(k.gravity, m.P);
    G[2 * j] = -weight[0];
    G[2 * j + 1] = -weight[1];
    for (int i = j - 1; i >= 0; --i) {
      const SegmentColumns& ancestor = segments[i];
      m.rotate_by<kCoriolis>(ancestor.turn);
      write_pair<kCoriolis>(i, j, ancestor, m, B, C);
      m.move_by<kCoriolis>(ancestor.tip, ancestor.tip_rate);
    }
    body.move_by(k.tip, side_by_side(k.tip, k.tip_rate));
    body.add(k.mass, k.own.first, k.own.second);
  }
}

template <bool kPolar>
SegmentColumns* outward(const ArmParameters& arm, DynamicsWorkspace& workspace,
                        const State& state) noexcept {
  SegmentColumns* segments = workspace.storage().columns.data();
  const auto run = arm.mass == MassModel::point ? outward<MassModel::point, kPolar>
                                                : outward<MassModel::distributed, kPolar>;
  run(arm, state, segments, from_eigen(arm.base_rotation.transpose() * arm.gravity_mps2));
  return segments;
}

/// A thick arm's columns come from the recursion, which knows rotary inertia: B e_j and C(u, u')
/// e_j.
void columns_of_recursion(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                          ConstVectorRef velocity, Eigen::Ref<Eigen::MatrixXd> B,
                          Eigen::Ref<Eigen::MatrixXd>* C) noexcept {
  auto& s = workspace.storage();
  s.rhs.setZero();
  for (Eigen::Index j = 0; j < u.size(); ++j) {
    s.rhs(j) = 1.0;
    inverse_dynamics(arm, workspace, u, s.zeros, s.zeros, s.rhs,
                     {.inertia = true, .coriolis = false, .gravity = false}, s.solution);
    // One triangle decides both: B is symmetric to the last bit.
    for (Eigen::Index i = 0; i <= j; ++i) B(i, j) = B(j, i) = s.solution(i);
    if (C != nullptr) {
      inverse_dynamics(arm, workspace, u, velocity, s.rhs, s.zeros,
                       {.inertia = false, .coriolis = true, .gravity = false}, s.solution);
      C->col(j) = s.solution.head(u.size());
    }
    s.rhs(j) = 0.0;
  }
}

}  // namespace

void dynamics_matrices(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                       ConstVectorRef velocity, Eigen::Ref<Eigen::MatrixXd> B,
                       Eigen::Ref<Eigen::MatrixXd> C, VectorRef G) noexcept {
  const auto* segments = outward<false>(arm, workspace, {u.data(), velocity.data()});
  inward<true>(arm.size(), segments, {B.data(), B.outerStride()}, {C.data(), C.outerStride()},
               G.data());
  if (arm.is_thick()) columns_of_recursion(arm, workspace, u, velocity, B, &C);
}

void polar_dynamics_matrices(const ArmParameters& arm, DynamicsWorkspace& workspace,
                             ConstVectorRef q, ConstVectorRef velocity,
                             Eigen::Ref<Eigen::MatrixXd> B, Eigen::Ref<Eigen::MatrixXd> C,
                             VectorRef G) noexcept {
  if (arm.is_thick()) {
    auto& s = workspace.storage();
    polar_to_u(q, s.residual);
    polar_velocity_to_u(q, velocity, s.bias);
    dynamics_matrices(arm, workspace, s.residual, s.bias, B, C, G);
    return dynamics_to_polar(q, velocity, B, C, G);
  }
  const auto* segments = outward<true>(arm, workspace, {q.data(), velocity.data()});
  inward<true>(arm.size(), segments, {B.data(), B.outerStride()}, {C.data(), C.outerStride()},
               G.data());
}

void inertia_matrix(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                    Eigen::Ref<Eigen::MatrixXd> B) noexcept {
  auto& s = workspace.storage();
  if (arm.is_thick()) return columns_of_recursion(arm, workspace, u, s.zeros, B, nullptr);
  const auto* segments = outward<false>(arm, workspace, {u.data(), s.zeros.data()});
  inward<false>(arm.size(), segments, {B.data(), B.outerStride()}, {nullptr, 0}, s.residual.data());
}

}  // namespace softarm
