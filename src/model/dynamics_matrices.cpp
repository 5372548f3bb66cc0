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
#include "model/dynamics_storage.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {
namespace {

/// Momenta of a column pair, handed from ancestor to ancestor.
struct ColumnMomenta {
  PairVector3 P, L, P_rate, L_rate, flow;

  void rotate_by(const Turn& turn) noexcept {
    P = rotate(turn, P);
    L = rotate(turn, L);
    P_rate = rotate(turn, P_rate);
    L_rate = rotate(turn, L_rate);
    flow = rotate(turn, flow);
  }
  void move_by(const Vector3& t, const Vector3& t_rate) noexcept {
    L += cross(t, P);
    L_rate += cross(t, P_rate);
    flow += cross(t_rate, P);
  }
};

struct Output {
  double* data;
  Eigen::Index stride;

  double& operator()(int row, int col) const noexcept { return data[row + col * stride]; }
};

template <MassModel kMass>
void outward(const ArmParameters& arm, const double* u, const double* velocity, SegmentColumns* out,
             Vector3 gravity) noexcept {
  Vector3 spin_of_frame{0, 0, 0};
  for (int i = 0; i < arm.size(); ++i) {
    const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
    const double ux = u[2 * i], uy = u[2 * i + 1], s = ux * ux + uy * uy;
    const auto c = entire < kMass == MassModel::point ? 8 : 12 > (s);
    const Curve tip = tip_curve(segment.length_m, c);
    const Spin rotation = spin(c);
    const Direction v = direction(ux, uy, velocity[2 * i], velocity[2 * i + 1]);
    SegmentColumns& k = out[i];
    k.turn = {ux, uy, c[0], c[1], c[2]};
    k.gravity = gravity;
    k.tip = point(tip, ux, uy);
    k.tip_rate = first(tip, ux, uy, v) + cross(spin_of_frame, k.tip);
    k.translation = columns(tip, ux, uy);
    k.rotation = columns(rotation, ux, uy);
    k.translation_rate = column_rates(tip, ux, uy, v) + cross(spin_of_frame, k.translation);
    k.rotation_rate = column_rates(rotation, ux, uy, v) + cross(spin_of_frame, k.rotation);
    const OwnState state{ux, uy, segment.mass_kg, segment.length_m, v, spin_of_frame};
    const Curve centre = centre_curve(segment.length_m, c);
    if constexpr (kMass == MassModel::point) {
      k.own = point_columns(state, centre);
    } else {
      const double scale = segment.mass_kg * segment.length_m * segment.length_m;
      k.own = arc_columns(state, centre, arc_moments(scale, s, c));
    }
    k.mass = segment.mass_kg;
    spin_of_frame = rotate_back(k.turn, spin_of_frame + first(rotation, ux, uy, v));
    gravity = rotate_back(k.turn, gravity);
  }
}

/// Column pair j over everything beyond p_j, about p_j.
ColumnMomenta beyond(const SegmentColumns& k, const Composite& body) noexcept {
  const Vector3 h = column(body.first, 0), h_rate = column(body.first, 1);
  const SecondMoments position(body.second, 0), mixed(body.second, 1);
  ColumnMomenta m;
  m.P = body.mass * k.translation - cross(h, k.rotation);
  m.L = cross(h, k.translation) + position.off_trace(k.rotation);
  m.P_rate = body.mass * k.translation_rate - cross(h, k.rotation_rate) - cross(h_rate, k.rotation);
  m.L_rate = cross(h, k.translation_rate) + position.off_trace(k.rotation_rate) +
             mixed.off_trace_transposed(k.rotation);
  m.flow = cross(h_rate, k.translation) + mixed.off_trace(k.rotation);
  return m;
}

void write_diagonal(int j, const SegmentColumns& k, const ColumnMomenta& m, const Output& B,
                    const Output& C) noexcept {
  for (int a = 0; a < 2; ++a) {
    const Vector3 v = column(k.translation, a), w = column(k.rotation, a);
    const Pair inertia = dot(v, m.P) + dot(w, m.L) + (a == 0 ? k.own.inertia_x : k.own.inertia_y);
    const Pair coriolis =
        dot(v, m.P_rate) + dot(w, m.L_rate) + (a == 0 ? k.own.coriolis_x : k.own.coriolis_y);
    for (int b = 0; b < 2; ++b) {
      // One triangle decides both, so that B is symmetric to the last bit.
      if (b >= a) B(2 * j + a, 2 * j + b) = B(2 * j + b, 2 * j + a) = inertia[b];
      C(2 * j + a, 2 * j + b) = coriolis[b];
    }
  }
}

void write_pair(int i, int j, const SegmentColumns& k, const ColumnMomenta& m, const Output& B,
                const Output& C) noexcept {
  for (int a = 0; a < 2; ++a) {
    const Vector3 v = column(k.translation, a), w = column(k.rotation, a);
    const Pair inertia = dot(v, m.P) + dot(w, m.L);
    const Pair upper = dot(v, m.P_rate) + dot(w, m.L_rate);
    const Pair lower = dot(column(k.translation_rate, a), m.P) +
                       dot(column(k.rotation_rate, a), m.L) + dot(w, m.flow);
    for (int b = 0; b < 2; ++b) {
      B(2 * i + a, 2 * j + b) = B(2 * j + b, 2 * i + a) = inertia[b];
      C(2 * i + a, 2 * j + b) = upper[b];
      C(2 * j + b, 2 * i + a) = lower[b];
    }
  }
}

void inward(int n, const SegmentColumns* segments, const Output& B, const Output& C,
            double* G) noexcept {
  Composite body;
  for (int j = n - 1; j >= 0; --j) {
    const SegmentColumns& k = segments[j];
    body.rotate_by(k.turn);
    ColumnMomenta m = beyond(k, body);
    write_diagonal(j, k, m, B, C);
    m.move_by(k.tip, k.tip_rate);
    m.P += k.own.momentum;
    m.L += k.own.angular;
    m.P_rate += k.own.momentum_rate;
    m.L_rate += k.own.angular_rate;
    m.flow += k.own.flow;
    const Pair weight = dot(k.gravity, m.P);
    G[2 * j] = -weight[0];
    G[2 * j + 1] = -weight[1];
    for (int i = j - 1; i >= 0; --i) {
      const SegmentColumns& ancestor = segments[i];
      m.rotate_by(ancestor.turn);
      write_pair(i, j, ancestor, m, B, C);
      m.move_by(ancestor.tip, ancestor.tip_rate);
    }
    body.move_by(k.tip, side_by_side(k.tip, k.tip_rate));
    body.add(k.mass, k.own.first, k.own.second);
  }
}

}  // namespace

void dynamics_matrices(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                       ConstVectorRef velocity, Eigen::Ref<Eigen::MatrixXd> B,
                       Eigen::Ref<Eigen::MatrixXd> C, VectorRef G) noexcept {
  SegmentColumns* segments = workspace.storage().columns.data();
  const Vector3 gravity = from_eigen(arm.base_rotation.transpose() * arm.gravity_mps2);
  if (arm.mass == MassModel::point) {
    outward<MassModel::point>(arm, u.data(), velocity.data(), segments, gravity);
  } else {
    outward<MassModel::distributed>(arm, u.data(), velocity.data(), segments, gravity);
  }
  inward(arm.size(), segments, {B.data(), B.outerStride()}, {C.data(), C.outerStride()}, G.data());
}

void inertia_matrix(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                    Eigen::Ref<Eigen::MatrixXd> B) noexcept {
  auto& s = workspace.storage();
  dynamics_matrices(arm, workspace, u, s.zeros, B, s.factor, s.residual);
}

}  // namespace softarm
