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
#include <limits>

#include "model/column_momenta.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {
namespace {

/// [u_x, u_y], [phi, theta] or [u_x, u_y, e] a segment.
enum class Coordinates { u, polar, ue };

/// Where the arm is and how it moves.
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
  void project_rows(OwnColumns<false>::Rows& rows) const noexcept {
    rows = {x[0] * rows[0] + y[0] * rows[1], x[1] * rows[0] + y[1] * rows[1]};
  }
  void apply(SegmentColumns<false>& k) const noexcept {
    apply(k.translation, k.translation_rate);
    apply(k.rotation, k.rotation_rate);
    OwnColumns<false>& own = k.own;
    apply(own.momentum, own.momentum_rate);
    apply(own.angular, own.angular_rate);
    apply(own.flow);
    for (std::size_t e = 0; e < 2; ++e) {
      own.coriolis[e] = times_map(own.coriolis[e]) + times_rate(own.inertia[e]);
      own.inertia[e] = times_map(own.inertia[e]);
    }
    project_rows(own.coriolis);
    project_rows(own.inertia);
  }
};

/// Four segments in u: what `outward` starts from.
template <bool kExtensible>
struct SegmentStates {
  ShapeLanes shape;
  DirectionOf<Lanes> velocity;
  Lanes strain_rate, inverse_length;       ///< only where segments stretch
  std::array<PolarColumns, kLanes> polar;  ///< only where the coordinates are
};

template <bool kArc, bool kExtensible>
void load_u(const ArmParameters& arm, int begin, const double* u, const double* rate,
            SegmentStates<kExtensible>& out) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  const int count = arm.size() - begin;
  out.shape.ux = load(u, kWidth, count);
  out.shape.uy = load(u + 1, kWidth, count);
  const Lanes length = set_shape<kArc, kExtensible>(arm, begin, u, out.shape);
  out.velocity = load_direction<kExtensible>(rate, count, out.shape);
  if constexpr (kExtensible) {
    out.inverse_length = 1.0 / length;
    out.strain_rate = load_strain_rate(rate, count, out.inverse_length);
  }
}

template <bool kArc>
void load_polar(const ArmParameters& arm, int begin, const double* q, const double* rate,
                SegmentStates<false>& out) noexcept {
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

/// Columns of segment i; without kRates only what B needs.
template <bool kArc, bool kRates, bool kExtensible>
[[gnu::always_inline]] inline void set_columns(const ArmParameters& arm, int i,
                                               const ShapeLanes& lanes,
                                               const SegmentState<kExtensible>& own,
                                               SegmentColumns<kExtensible>& k) noexcept {
  const int l = lane_of(i);
  const Curve centre = lane(lanes.centre, l);
  const Spin rotation = lane(lanes.turn_rate, l);
  k.turn = turn(lanes, l);
  k.mass = lanes.mass[l];
  const auto end = point_motion(lane(lanes.tip, l), own);
  k.tip = end.place;
  k.translation = end.J;
  const PairVector3 spins = columns(rotation, own.ux, own.uy);
  k.rotation = without_elongation<kExtensible>(spins);
  if constexpr (kRates) {
    k.tip_rate = end.rate;
    k.translation_rate = end.J_rate;
    k.rotation_rate = without_elongation<kExtensible>(
        column_rates(rotation, own.ux, own.uy, own.v) + cross(own.spin, spins));
  }
  if constexpr (kArc) {
    k.own = arc_columns<kRates>(k.mass, own, centre, lane(lanes.arc, l));
    const double radius = arm.segments[static_cast<std::size_t>(i)].radius_m;
    if (radius > 0.0) add_discs<kRates>(0.25 * k.mass * radius * radius, own, k.own);
  } else {
    k.own = point_columns<kRates>(k.mass, own, centre);
  }
}

template <MassModel kMass, Coordinates kCoords>
void outward(const ArmParameters& arm, const State& state,
             SegmentColumns<kCoords == Coordinates::ue>* out, Vector3 gravity) noexcept {
  constexpr bool kArc = kMass == MassModel::distributed;
  constexpr bool kPolar = kCoords == Coordinates::polar, kExtensible = kCoords == Coordinates::ue;
  constexpr int kWidth = kCoordinates<kExtensible>;
  SegmentStates<kExtensible> states;
  const ShapeLanes& lanes = states.shape;
  Vector3 spin_of_frame{0, 0, 0};
  for (int i = 0; i < arm.size(); ++i) {
    const int l = lane_of(i);
    if (l == 0) {
      const double *q = state.q + kWidth * i, *rate = state.velocity + kWidth * i;
      if constexpr (kPolar) {
        load_polar<kArc>(arm, i, q, rate, states);
      } else {
        load_u<kArc>(arm, i, q, rate, states);
      }
    }
    const double ux = lanes.ux[l], uy = lanes.uy[l];
    const Direction v = lane(states.velocity, l);
    SegmentState<kExtensible> own{ux, uy, v, spin_of_frame, {}};
    if constexpr (kExtensible) own.stretch = {states.strain_rate[l], states.inverse_length[l]};
    SegmentColumns<kExtensible>& k = out[i];
    set_columns<kArc, true>(arm, i, lanes, own, k);
    k.gravity = gravity;
    if constexpr (kPolar) states.polar[static_cast<std::size_t>(l)].apply(k);
    spin_of_frame = rotate_back(k.turn, spin_of_frame + first(lane(lanes.turn_rate, l), ux, uy, v));
    gravity = rotate_back(k.turn, gravity);
  }
}

template <bool kCoriolis, bool kExtensible>
void write_diagonal(int j, const SegmentColumns<kExtensible>& k,
                    const ColumnMomenta<Columns<kExtensible>>& m, const Output& B,
                    const Output& C) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  const Output B_jj = B.from(kWidth * j, kWidth * j), C_jj = C.from(kWidth * j, kWidth * j);
  for (int a = 0; a < kWidth; ++a) {
    const auto row = static_cast<std::size_t>(a);
    const Vector3 v = column(k.translation, a), w = column(k.rotation, a);
    const auto inertia = dot(v, m.P) + dot(w, m.L) + k.own.inertia[row];
    for (int b = a; b < kWidth; ++b) {  // one triangle decides both: B is symmetric to the last bit
      B_jj(a, b) = B_jj(b, a) = inertia[b];
    }
    if constexpr (!kCoriolis) continue;
    const auto coriolis = dot(v, m.P_rate) + dot(w, m.L_rate) + k.own.coriolis[row];
    for (int b = 0; b < kWidth; ++b) C_jj(a, b) = coriolis[b];
  }
}

template <bool kCoriolis, bool kExtensible>
void write_pair(int i, int j, const SegmentColumns<kExtensible>& k,
                const ColumnMomenta<Columns<kExtensible>>& m, const Output& B,
                const Output& C) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  const Output B_ij = B.from(kWidth * i, kWidth * j), B_ji = B.from(kWidth * j, kWidth * i);
  const Output C_ij = C.from(kWidth * i, kWidth * j), C_ji = C.from(kWidth * j, kWidth * i);
  for (int a = 0; a < kWidth; ++a) {
    const Vector3 v = column(k.translation, a), w = column(k.rotation, a);
    const auto inertia = dot(v, m.P) + dot(w, m.L);
    for (int b = 0; b < kWidth; ++b) B_ij(a, b) = B_ji(b, a) = inertia[b];
    if constexpr (!kCoriolis) continue;
    const auto upper = dot(v, m.P_rate) + dot(w, m.L_rate);
    const auto lower = dot(column(k.translation_rate, a), m.P) +
                       dot(column(k.rotation_rate, a), m.L) + dot(w, m.flow);
    for (int b = 0; b < kWidth; ++b) {
      C_ij(a, b) = upper[b];
      C_ji(b, a) = lower[b];
    }
  }
}

template <bool kCoriolis, bool kExtensible>
void inward(int n, const SegmentColumns<kExtensible>* segments, const Output& B, const Output& C,
            double* G) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  constexpr Momenta kWhich = kCoriolis ? Momenta::rates : Momenta::inertia;
  Composite body;
  for (int j = n - 1; j >= 0; --j) {
    const SegmentColumns<kExtensible>& k = segments[j];
    body.rotate_by(k.turn);
    auto m = beyond<kWhich>(k, body);
    write_diagonal<kCoriolis>(j, k, m, B, C);
    m.template move_past<kWhich>(k);
    if constexpr (kCoriolis) {
      const auto weight = dot(k.gravity, m.P);
      for (int a = 0; a < kWidth; ++a) G[kWidth * j + a] = -weight[a];
    }
    for (int i = j - 1; i >= 0; --i) {
      const SegmentColumns<kExtensible>& ancestor = segments[i];
      m.template rotate_by<kWhich>(ancestor.turn);
      write_pair<kCoriolis>(i, j, ancestor, m, B, C);
      m.template move_by<kWhich>(ancestor.tip, ancestor.tip_rate);
    }
    body.move_by(k.tip, side_by_side(k.tip, k.tip_rate));
    body.add(k.mass, k.own.first, k.own.second);
  }
}

template <Coordinates kCoords>
auto* set_all_columns(const ArmParameters& arm, DynamicsWorkspace& workspace,
                      const State& state) noexcept {
  auto* const segments = workspace.storage().of<kCoords == Coordinates::ue>().columns.data();
  const auto run = arm.mass == MassModel::point ? outward<MassModel::point, kCoords>
                                                : outward<MassModel::distributed, kCoords>;
  run(arm, state, segments, from_eigen(arm.base_rotation.transpose() * arm.gravity_mps2));
  return segments;
}

template <Coordinates kCoords>
void evaluate(const ArmParameters& arm, DynamicsWorkspace& workspace, const State& state,
              const Output& B, const Output& C, double* G) noexcept {
  inward<true>(arm.size(), set_all_columns<kCoords>(arm, workspace, state), B, C, G);
}

/// B alone, of the shape in the workspace.
template <bool kArc, bool kExtensible>
void evaluate_inertia(const ArmParameters& arm, SegmentStorage<kExtensible>& s,
                      const Output& B) noexcept {
  for (int i = 0; i < arm.size(); ++i) {
    const auto& lanes = s.lanes[group_of(i)];
    const int l = lane_of(i);
    SegmentState<kExtensible> own{lanes.ux[l], lanes.uy[l], {}, {}, {}};
    if constexpr (kExtensible) own.stretch = {0.0, lanes.inverse_length[l]};
    set_columns<kArc, false>(arm, i, lanes, own, s.columns[static_cast<std::size_t>(i)]);
  }
  inward<false>(arm.size(), s.columns.data(), B, B, nullptr);
}

template <bool kArc, bool kExtensible>
void load_shapes(const ArmParameters& arm, const double* u, SegmentStorage<kExtensible>& s) {
  for (int i = 0; i < arm.size(); i += kLanes) load_shape<kArc>(arm, i, u, s.lanes[group_of(i)]);
}

/// B at u, or of the last shape where there is none.
template <bool kExtensible>
void inertia(const ArmParameters& arm, SegmentStorage<kExtensible>& s, const double* u,
             const Output& B) noexcept {
  if (arm.mass == MassModel::point) {
    if (u != nullptr) load_shapes<false>(arm, u, s);
    evaluate_inertia<false>(arm, s, B);
  } else {
    if (u != nullptr) load_shapes<true>(arm, u, s);
    evaluate_inertia<true>(arm, s, B);
  }
}

void inertia(const ArmParameters& arm, DynamicsWorkspace::Storage& s, const double* u,
             Eigen::Ref<Eigen::MatrixXd>& B) noexcept {
  const Output out{B.data(), B.outerStride()};
  if (arm.extensible) return inertia(arm, s.extensible, u, out);
  inertia(arm, s.inextensible, u, out);
}

/// Segments that stretch have no polar form.
void fill_with_nan(Eigen::Ref<Eigen::MatrixXd>& B, Eigen::Ref<Eigen::MatrixXd>& C,
                   VectorRef& G) noexcept {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  B.setConstant(kNan);
  C.setConstant(kNan);
  G.setConstant(kNan);
}

}  // namespace

void set_columns_of(const ArmParameters& arm, DynamicsWorkspace& workspace, const double* u,
                    const double* velocity) noexcept {
  if (arm.extensible) {
    set_all_columns<Coordinates::ue>(arm, workspace, {u, velocity});
  } else {
    set_all_columns<Coordinates::u>(arm, workspace, {u, velocity});
  }
}

void dynamics_matrices(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                       ConstVectorRef velocity, Eigen::Ref<Eigen::MatrixXd> B,
                       Eigen::Ref<Eigen::MatrixXd> C, VectorRef G) noexcept {
  const auto run = arm.extensible ? evaluate<Coordinates::ue> : evaluate<Coordinates::u>;
  run(arm, workspace, {u.data(), velocity.data()}, {B.data(), B.outerStride()},
      {C.data(), C.outerStride()}, G.data());
}

void polar_dynamics_matrices(const ArmParameters& arm, DynamicsWorkspace& workspace,
                             ConstVectorRef q, ConstVectorRef velocity,
                             Eigen::Ref<Eigen::MatrixXd> B, Eigen::Ref<Eigen::MatrixXd> C,
                             VectorRef G) noexcept {
  if (arm.extensible) return fill_with_nan(B, C, G);
  evaluate<Coordinates::polar>(arm, workspace, {q.data(), velocity.data()},
                               {B.data(), B.outerStride()}, {C.data(), C.outerStride()}, G.data());
}

void inertia_matrix(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                    Eigen::Ref<Eigen::MatrixXd> B) noexcept {
  inertia(arm, workspace.storage(), u.data(), B);
}

void inertia_of_last_shape(const ArmParameters& arm, DynamicsWorkspace& workspace,
                           Eigen::Ref<Eigen::MatrixXd> B) noexcept {
  inertia(arm, workspace.storage(), nullptr, B);
}

}  // namespace softarm
