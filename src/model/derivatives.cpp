// A change of segment j's own coordinates does two things: to its own mass, in dual numbers along
// these two or three coordinates; and to everything beyond, which moves as one body in S_j: tangents
// of the frame's acceleration, angular acceleration and spin. What those do is linear, and known from
// the same moments and column momenta as B and C (dynamics_matrices.cpp), for a pair of segments in
// constant time:
//   beyond j by dq_j:  dF = m da - h x dalpha - 2 h' x dw, and its moment likewise
//   tau_i by dq_j, i < j: v_i . dF + w_i . dM
//   tau_j by dq_i, i < j: P_j . da_i + L_j . dalpha_i + 2 F_j . dw_i   (P, L, F about p_i)
// with dalpha that of the angular acceleration plus w x dw.
#include "softarm/model/derivatives.hpp"

#include <array>
#include <limits>
#include <vector>

#include "model/column_momenta.hpp"
#include "model/segment_forces.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {
namespace {

using namespace recursion;

template <bool kExtensible>
using SegmentDual = std::conditional_t<kExtensible, StretchDual, BendingDual>;

/// What a change of a segment's own coordinates does.
template <bool kExtensible>
struct SegmentSlopes {
  using T = SegmentDual<kExtensible>;
  using Column = Columns<kExtensible>;

  Vec3<Column> linear, angular, twice_spin;  ///< tangents of its end's motion, in S_{i-1}
  ForcesOf<kExtensible, T> own;              ///< of its mass, with S_{i-1} moving as it does
  // What meets the force of everything beyond.
  T ux, uy, inverse_length;
  CurveOf<T> tip;
  SpinOf<T> turn_rate;
};

/// Of an arm of either kind; the other one's is empty.
template <bool kExtensible>
struct Slopes {
  explicit Slopes(std::size_t n) : functions((n + kLanes - 1) / kLanes), segments(n) {}

  std::vector<ShapeFunctionsOf<SlopeLanes>> functions;  ///< by s, of four segments each
  std::vector<SegmentSlopes<kExtensible>> segments;
};

/// What the weight of four segments at rest needs: first and second derivatives along u_x and u_y.
struct RestLanes {
  using Pairs = std::array<Vec3<Lanes>, 3>;  // xx, xy, yy

  std::array<Vec3<Lanes>, 2> tip, centre, spin;
  Pairs tip_second, centre_second, spin_second;

  void set(const ShapeLanes& k) noexcept {
    const Lanes one{1.0, 1.0, 1.0, 1.0}, none{};
    const std::array along{direction(k.ux, k.uy, one, none), direction(k.ux, k.uy, none, one)};
    const auto differentiate = [&](const auto& f, std::array<Vec3<Lanes>, 2>& once, Pairs& twice) {
      once = {first(f, k.ux, k.uy, along[0]), first(f, k.ux, k.uy, along[1])};
      twice = {second(f, k.ux, k.uy, along[0], along[0]), second(f, k.ux, k.uy, along[0], along[1]),
               second(f, k.ux, k.uy, along[1], along[1])};
    };
    differentiate(k.tip, tip, tip_second);
    differentiate(k.centre, centre, centre_second);
    differentiate(k.turn_rate, spin, spin_second);
  }
};

/// One segment at rest, in S_{i-1}.
struct RestSegment {
  Turn turn;
  Vector3 lift;                     ///< against gravity, m/s^2
  std::array<Vector3, 2> rotation;  ///< columns along u_x and u_y
};

/// Of an arm at rest.
template <bool kExtensible>
struct Rest {
  explicit Rest(std::size_t n)
      : shapes((n + kLanes - 1) / kLanes), lanes(shapes.size()), segments(n) {}

  std::vector<LanesOf<kExtensible, Lanes>> shapes;
  std::vector<RestLanes> lanes;
  std::vector<RestSegment> segments;
};

/// A function of one segment's s with its length to a power, in duals of its coordinates.
template <bool kExtensible>
struct Widen {
  double twice_ux, twice_uy, per_length;
  int lane;

  template <int kPower>
  SegmentDual<kExtensible> of(const SlopeLanes& f) const noexcept {
    const double v = f.v[lane], by_s = f.d[lane];
    if constexpr (kExtensible) {
      return {v, Quad{by_s * twice_ux, by_s * twice_uy, kPower * per_length * v, 0.0}};
    } else {
      return {v, Pair{by_s * twice_ux, by_s * twice_uy}};
    }
  }
  auto curve(const CurveOf<SlopeLanes>& f) const noexcept {
    return CurveOf<SegmentDual<kExtensible>>{of<1>(f.p),  of<1>(f.q),  of<1>(f.p1),
                                             of<1>(f.q1), of<1>(f.p2), of<1>(f.q2)};
  }
  auto spin(const SpinOf<SlopeLanes>& f) const noexcept {
    return SpinOf<SegmentDual<kExtensible>>{of<0>(f.c1),    of<0>(f.c2),   of<0>(f.c3),
                                            of<0>(f.mixed), of<0>(f.c3_1), of<0>(f.c2_1)};
  }
  auto moments(const ArcMomentsOf<SlopeLanes>& f) const noexcept {
    return ArcMomentsOf<SegmentDual<kExtensible>>{
        of<2>(f.pp),  of<2>(f.pq),   of<2>(f.qq),   of<2>(f.pp1),  of<2>(f.pq1),
        of<2>(f.qp1), of<2>(f.qq1),  of<2>(f.pp2),  of<2>(f.pq2),  of<2>(f.qp2),
        of<2>(f.qq2), of<2>(f.p1p1), of<2>(f.q1q1), of<2>(f.p1p2), of<2>(f.q1q2)};
  }
};

/// The coordinate `along` of a segment: its tangent is 1.
template <bool kExtensible>
SegmentDual<kExtensible> coordinate(double value, int along) noexcept {
  const auto one = [along](int k) { return k == along ? 1.0 : 0.0; };
  if constexpr (kExtensible) {
    return {value, Quad{one(0), one(1), one(2), 0.0}};
  } else {
    return {value, Pair{one(0), one(1)}};
  }
}

template <class T>
auto values(const Vec3<T>& v) noexcept {
  return Vector3{v.x.v, v.y.v, v.z.v};
}
template <class T>
auto tangents(const Vec3<T>& v) noexcept {
  return Vec3{v.x.d, v.y.d, v.z.d};
}
template <bool kExtensible>
auto dual(const Vector3& v, const Vec3<Columns<kExtensible>>& d) noexcept {
  return Vec3<SegmentDual<kExtensible>>{{v.x, d.x}, {v.y, d.y}, {v.z, d.z}};
}

/// What segment i does within its own frame, in duals.
template <MassModel kMass, bool kExtensible>
void set_own(const ArmParameters& arm, const Inputs& in, int i,
             const ShapeFunctionsOf<SlopeLanes>& f,
             LanesOf<kExtensible, SegmentDual<kExtensible>>& k) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  const double* const q = in.u + kWidth * i;
  const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
  Widen<kExtensible> widen{2.0 * q[0], 2.0 * q[1], 0.0, lane_of(i)};
  k.ux = coordinate<kExtensible>(q[0], 0);
  k.uy = coordinate<kExtensible>(q[1], 1);
  if constexpr (kExtensible) {
    k.inverse_length = 1.0 / (segment.length_m + coordinate<kExtensible>(q[2], 2));
    widen.per_length = k.inverse_length.v;
  }
  k.mass = segment.mass_kg;
  k.c0 = widen.template of<0>(f.c0);
  k.tip = widen.curve(f.tip);
  k.centre = widen.curve(f.centre);
  k.turn_rate = widen.spin(f.turn_rate);
  if constexpr (kMass == MassModel::distributed) k.arc = widen.moments(f.arc);
  const auto number = [i](const double* v, int e) { return v[kWidth * i + e]; };
  set_own_motion<kMass, true, true>(in, number, k);
}

/// Slopes of the segment whose frame moves so, and how the next one's moves.
template <MassModel kMass, bool kExtensible>
FrameMotionOf<double> set_slopes(const ArmParameters& arm, const Inputs& in, int i,
                                 const ShapeFunctionsOf<SlopeLanes>& f,
                                 const FrameMotionOf<double>& m,
                                 const SegmentColumns<kExtensible>& columns,
                                 SegmentSlopes<kExtensible>& out) noexcept {
  LanesOf<kExtensible, SegmentDual<kExtensible>> k;
  set_own<kMass, kExtensible>(arm, in, i, f, k);
  Vec3<SegmentDual<kExtensible>> end_linear, end_angular;
  const auto move = [&](const auto& frame) {
    own_forces<kMass>(k, 0, m.linear, frame, out.own);
    end_linear = end_acceleration(k, 0, frame, m);
    end_angular = end_angular_acceleration<true>(k, 0, frame, m);
  };
  if (i == 0) {
    move(StillFrame{});
  } else {
    move(frame_acceleration<true>(m, k, 0));
  }
  const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
  if (kMass == MassModel::distributed && segment.radius_m > 0.0) {
    add_rotary_inertia<true, true>(segment, in.x + kCoordinates<kExtensible> * i, 0, k, m, out.own);
  }
  out.ux = k.ux;
  out.uy = k.uy;
  if constexpr (kExtensible) out.inverse_length = k.inverse_length;
  out.tip = k.tip;
  out.turn_rate = k.turn_rate;

  // Seen from S_i, which turns by columns.rotation.
  const auto end_spin = m.spin_a + k.spin_a;
  const Vector3 linear = values(end_linear), spin = values(end_spin), angular = values(end_angular);
  const auto spin_slope = tangents(end_spin) - cross(columns.rotation, spin);
  out.linear = tangents(end_linear) - cross(columns.rotation, linear);
  out.angular = tangents(end_angular) - cross(columns.rotation, angular) + cross(spin, spin_slope);
  out.twice_spin = 2.0 * spin_slope;
  const Vector3 next_spin = rotate_back(columns.turn, spin);
  return {next_spin, next_spin, rotate_back(columns.turn, angular),
          rotate_back(columns.turn, linear)};
}

/// A force and its moment.
template <class T>
struct Wrench {
  Vec3<T> force, moment;
};

/// Tangents of what everything beyond p_j does, about p_j in S_{j-1}, where its sum is `beyond`.
template <bool kExtensible>
auto slopes_beyond(const SegmentSlopes<kExtensible>& d, const SegmentColumns<kExtensible>& k,
                   const Composite& body, const Wrench<double>& beyond) noexcept {
  const Vector3 h = column(body.first, 0), h_rate = column(body.first, 1);
  const SecondMoments position(body.second, 0), mixed(body.second, 1);
  return Wrench<Columns<kExtensible>>{
      body.mass * d.linear - cross(h, d.angular) - cross(h_rate, d.twice_spin) +
          cross(k.rotation, beyond.force),
      cross(h, d.linear) + position.off_trace(d.angular) +
          mixed.off_trace_transposed(d.twice_spin) + cross(k.rotation, beyond.moment)};
}

template <class T>
void write_row(const Output& out, int row, int col, int width, const T& numbers) noexcept {
  for (int e = 0; e < width; ++e) out(row, col + e) = numbers[e];
}

/// The diagonal block, and `beyond` and its slopes carried on to p_{j-1}.
template <bool kExtensible>
void write_own_block(int j, const SegmentSlopes<kExtensible>& d, Wrench<double>& beyond,
                     Wrench<Columns<kExtensible>>& slope, const Output& out) noexcept {
  using T = SegmentDual<kExtensible>;
  constexpr int kWidth = kCoordinates<kExtensible>;
  auto force = dual<kExtensible>(beyond.force, slope.force);
  auto moment = dual<kExtensible>(beyond.moment, slope.moment);
  const auto [x, y] = torque_from_beyond(d, 0, force, moment);
  const int at = kWidth * j;
  write_row(out, at, at, kWidth, (d.own.torque_x + x).d);
  write_row(out, at + 1, at, kWidth, (d.own.torque_y + y).d);
  if constexpr (kExtensible) {
    const T by_growth = d.own.virial + virial(d.ux, d.uy, d.tip.p, d.tip.q, force);
    write_row(out, at + 2, at, kWidth, (by_growth * d.inverse_length).d);
  }
  moment += d.own.moment + cross(point(d.tip, d.ux, d.uy), force);
  force += d.own.force;
  beyond = {values(force), values(moment)};
  slope = {tangents(force), tangents(moment)};
}

/// Rows of the ancestor i in the columns of j, and of j in those of i.
template <bool kExtensible>
void write_blocks(int i, int j, const SegmentColumns<kExtensible>& k,
                  const SegmentSlopes<kExtensible>& d, const ColumnMomenta<Columns<kExtensible>>& m,
                  const Wrench<Columns<kExtensible>>& slope, const Output& out) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  for (int a = 0; a < kWidth; ++a) {
    const auto upper =
        dot(column(k.translation, a), slope.force) + dot(column(k.rotation, a), slope.moment);
    const auto lower = dot(column(d.linear, a), m.P) + dot(column(d.angular, a), m.L) +
                       dot(column(d.twice_spin, a), m.flow);
    write_row(out, kWidth * i + a, kWidth * j, kWidth, upper);
    for (int e = 0; e < kWidth; ++e) out(kWidth * j + e, kWidth * i + a) = lower[e];
  }
}

/// d (B u'' + C u' + G) / du; the workspace's columns are those of this state.
template <MassModel kMass, bool kExtensible>
void inverse_dynamics_slope(const ArmParameters& arm, const Inputs& in,
                            const std::vector<SegmentColumns<kExtensible>>& columns,
                            Slopes<kExtensible>& s, const Output& out) noexcept {
  const int n = arm.size();
  FrameMotionOf<double> m{
      {}, {}, {}, from_eigen(-(arm.base_rotation.transpose() * arm.gravity_mps2))};
  for (int i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    auto& functions = s.functions[group_of(i)];
    if (lane_of(i) == 0) {
      const double* const q = in.u + kCoordinates<kExtensible> * i;
      const Lanes ux = load(q, kCoordinates<kExtensible>, n - i);
      const Lanes uy = load(q + 1, kCoordinates<kExtensible>, n - i);
      const SlopeLanes square{ux * ux + uy * uy, Lanes{1.0, 1.0, 1.0, 1.0}};
      set_functions<kMass == MassModel::distributed>(
          LengthsAndMasses::load_from<kExtensible>(arm, i, q), square, functions);
    }
    m = set_slopes<kMass>(arm, in, i, functions, m, columns[at], s.segments[at]);
  }

  Composite body;
  Wrench<double> beyond{{}, {}};
  for (int j = n - 1; j >= 0; --j) {
    const auto at = static_cast<std::size_t>(j);
    const SegmentColumns<kExtensible>& k = columns[at];
    const SegmentSlopes<kExtensible>& d = s.segments[at];
    body.rotate_by(k.turn);
    beyond = {rotate(k.turn, beyond.force), rotate(k.turn, beyond.moment)};
    auto slope = slopes_beyond(d, k, body, beyond);
    write_own_block(j, d, beyond, slope, out);
    if (j == 0) return;
    auto momenta = softarm::beyond<Momenta::slopes>(k, body);
    momenta.template move_past<Momenta::slopes>(k);
    for (int i = j - 1; i >= 0; --i) {
      const SegmentColumns<kExtensible>& ancestor = columns[static_cast<std::size_t>(i)];
      momenta.template rotate_by<Momenta::slopes>(ancestor.turn);
      slope = {rotate(ancestor.turn, slope.force), rotate(ancestor.turn, slope.moment)};
      write_blocks(i, j, ancestor, s.segments[static_cast<std::size_t>(i)], momenta, slope, out);
      momenta.template move_by<Momenta::slopes>(ancestor.tip, ancestor.tip_rate);
      slope.moment += cross(ancestor.tip, slope.force);
    }
    body.move_by(k.tip, side_by_side(k.tip, k.tip_rate));
    body.add(k.mass, k.own.first, k.own.second);
  }
}

/// dG/du, a Hessian: one triangle decides both.
template <bool kExtensible>
void gravity_slope_of(const ArmParameters& arm, const double* u, Rest<kExtensible>& s,
                      const Output& out) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  const int n = arm.size();
  Vector3 lift = from_eigen(-(arm.base_rotation.transpose() * arm.gravity_mps2));
  for (int i = 0; i < n; ++i) {
    auto& shape = s.shapes[group_of(i)];
    auto& lanes = s.lanes[group_of(i)];
    const int l = lane_of(i);
    if (l == 0) {
      load_shape<false>(arm, i, u, shape);
      lanes.set(shape);
    }
    const Turn to_next = turn(shape, l);
    s.segments[static_cast<std::size_t>(i)] = {
        to_next, lift, {lane(lanes.spin[0], l), lane(lanes.spin[1], l)}};
    lift = rotate_back(to_next, lift);
  }

  double mass = 0.0;       // of everything beyond p_j
  Vector3 first_moment{};  // and about p_j
  for (int j = n - 1; j >= 0; --j) {
    const RestSegment& k = s.segments[static_cast<std::size_t>(j)];
    const auto& shape = s.shapes[group_of(j)];
    const RestLanes& lanes = s.lanes[group_of(j)];
    const int l = lane_of(j), at_j = kWidth * j;
    const double own = shape.mass[l];
    const auto weighed = [&](const Vec3<Lanes>& tip, const Vec3<Lanes>& centre) {
      return mass * lane(tip, l) + own * lane(centre, l);
    };
    const Vector3 h = rotate(k.turn, first_moment);
    std::array<Vector3, 2> along, swept,
        lifted;  // own motion; that of h; lift x column of rotation
    for (std::size_t a = 0; a < 2; ++a) {
      along[a] = weighed(lanes.tip[a], lanes.centre[a]);
      swept[a] = cross(k.rotation[a], h);
      lifted[a] = cross(k.lift, k.rotation[a]);
    }
    const auto both = [&](std::size_t pair, std::size_t a, std::size_t b) {
      const Vector3 own_second = weighed(lanes.tip_second[pair], lanes.centre_second[pair]) +
                                 cross(lane(lanes.spin_second[pair], l), h);
      return dot(k.lift, own_second) + 0.5 * (dot(lifted[a], swept[b]) + dot(lifted[b], swept[a]));
    };
    out(at_j, at_j) = both(0, 0, 0);
    out(at_j, at_j + 1) = out(at_j + 1, at_j) = both(1, 0, 1);
    out(at_j + 1, at_j + 1) = both(2, 1, 1);
    const auto place = [&](const CurveOf<Lanes>& f) {
      return point(lane(f, l), shape.ux[l], shape.uy[l]);
    };
    const Vector3 radial = mass * place(shape.tip) + own * place(shape.centre);
    // Moments of the weight of what column b moves: what turns it meets.
    PairVector3 moved = side_by_side(along[0] + swept[0], along[1] + swept[1]);
    Vec3<Columns<kExtensible>> moment;
    if constexpr (kExtensible) {
      const double per_length = shape.inverse_length[l];
      for (int a = 0; a < 2; ++a) {
        out(at_j + 2, at_j + a) = out(at_j + a, at_j + 2) =
            per_length * dot(k.lift, along[static_cast<std::size_t>(a)]);
      }
      out(at_j + 2, at_j + 2) = 0.0;
      moment = cross(beside(moved, per_length * radial), k.lift);
    } else {
      moment = cross(moved, k.lift);
    }
    for (int i = j - 1; i >= 0; --i) {
      const RestSegment& ancestor = s.segments[static_cast<std::size_t>(i)];
      moment = rotate(ancestor.turn, moment);
      for (int a = 0; a < kWidth; ++a) {
        const int row = kWidth * i + a;
        Columns<kExtensible> entries{};
        if (a < 2) entries = dot(ancestor.rotation[static_cast<std::size_t>(a)], moment);
        for (int e = 0; e < kWidth; ++e) {
          out(row, at_j + e) = out(at_j + e, row) = entries[e];
        }
      }
    }
    first_moment = h + radial;
    mass += own;
  }
}

/// out = -A B, square.
template <int kSize>
void negative_product(const Eigen::MatrixXd& B, const MatrixRef& A, MatrixRef& out) noexcept {
  if constexpr (kSize == 0) {
    out.noalias() = -A * B;
    return;
  }
  const double *const a = A.data(), *b = B.data();
  for (Eigen::Index j = 0; j < kSize; ++j, b += kSize) {
    std::array<double, kSize == 0 ? 1 : kSize> sum{};
#pragma GCC unroll 9
    for (Eigen::Index k = 0; k < kSize; ++k) {
      const double factor = b[k];
#pragma GCC unroll 9
      for (Eigen::Index i = 0; i < kSize; ++i) {
        sum[static_cast<std::size_t>(i)] -= a[i + k * A.outerStride()] * factor;
      }
    }
    for (Eigen::Index i = 0; i < kSize; ++i) out(i, j) = sum[static_cast<std::size_t>(i)];
  }
}

}  // namespace

struct ModelDerivatives::Storage {
  explicit Storage(const ArmParameters& parameters)
      : arm(parameters),
        workspace(parameters),
        bending(parameters.extensible ? 0 : parameters.segments.size()),
        stretching(parameters.extensible ? parameters.segments.size() : 0),
        bending_rest(bending.segments.size()),
        stretching_rest(stretching.segments.size()),
        bias(parameters.dof()),
        B(parameters.dof(), parameters.dof()),
        C(parameters.dof(), parameters.dof()),
        slope(parameters.dof(), parameters.dof()) {}

  /// The workspace's columns are those of this state.
  void slope_by_u(const Inputs& in, MatrixRef out) noexcept {
    const Output to{out.data(), out.outerStride()};
    const bool arc = arm.mass == MassModel::distributed;
    auto& kept = workspace.storage();
    if (arm.extensible) {
      const auto run = arc ? inverse_dynamics_slope<MassModel::distributed, true>
                           : inverse_dynamics_slope<MassModel::point, true>;
      run(arm, in, kept.extensible.columns, stretching, to);
    } else {
      const auto run = arc ? inverse_dynamics_slope<MassModel::distributed, false>
                           : inverse_dynamics_slope<MassModel::point, false>;
      run(arm, in, kept.inextensible.columns, bending, to);
    }
    add_stiffness(out);
  }

  void add_stiffness(MatrixRef out) const noexcept {
    add_diagonal(&SegmentParameters::stiffness_nm_per_rad,
                 &SegmentParameters::axial_stiffness_n_per_m, out);
  }

  /// B^-1 of the matrix that was solved last; zero where lengths are held.
  void invert_inertia(MatrixRef& out) noexcept {
    inverse_of_last_inertia(workspace, out);
    for (int i = 0; arm.extensible && i < arm.size(); ++i) {
      if (!arm.segments[static_cast<std::size_t>(i)].constant_length) continue;
      out.row(3 * i + 2).setZero();
      out.col(3 * i + 2).setZero();
    }
  }

  void add_diagonal(double SegmentParameters::*bent, double SegmentParameters::*stretched,
                    MatrixRef out) const noexcept {
    const int width = arm.segment_dof();
    for (int k = 0; k < arm.dof(); ++k) {
      const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(k / width)];
      out(k, k) += segment.*(k % width == 2 ? stretched : bent);
    }
  }

  ArmParameters arm;
  DynamicsWorkspace workspace;
  Slopes<false> bending;
  Slopes<true> stretching;
  Rest<false> bending_rest;
  Rest<true> stretching_rest;
  Eigen::VectorXd bias;
  Eigen::MatrixXd B, C, slope;
};

ModelDerivatives::ModelDerivatives(const ArmParameters& arm)
    : storage_(std::make_unique<Storage>(arm)) {}
ModelDerivatives::~ModelDerivatives() = default;
ModelDerivatives::ModelDerivatives(ModelDerivatives&&) noexcept = default;
ModelDerivatives& ModelDerivatives::operator=(ModelDerivatives&&) noexcept = default;

void ModelDerivatives::inverse_dynamics_by_u(ConstVectorRef u, ConstVectorRef velocity,
                                             ConstVectorRef acceleration, MatrixRef by_u) noexcept {
  set_columns_of(storage_->arm, storage_->workspace, u.data(), velocity.data());
  storage_->slope_by_u({u.data(), velocity.data(), velocity.data(), acceleration.data()}, by_u);
}

void ModelDerivatives::static_stiffness(ConstVectorRef u, MatrixRef by_u) noexcept {
  Storage& s = *storage_;
  const Output out{by_u.data(), by_u.outerStride()};
  if (s.arm.extensible) {
    gravity_slope_of(s.arm, u.data(), s.stretching_rest, out);
  } else {
    gravity_slope_of(s.arm, u.data(), s.bending_rest, out);
  }
  s.add_stiffness(by_u);
}

bool ModelDerivatives::forward_dynamics(ConstVectorRef u, ConstVectorRef velocity,
                                        ConstVectorRef generalized_force, VectorRef acceleration,
                                        MatrixRef by_u, MatrixRef by_velocity,
                                        MatrixRef by_force) noexcept {
  Storage& s = *storage_;
  const ArmParameters& arm = s.arm;
  dynamics_matrices(arm, s.workspace, u, velocity, s.B, s.C, s.bias);
  s.bias.noalias() += s.C * velocity;
  add_impedance(arm, u, velocity, s.bias);
  s.bias = generalized_force - s.bias;
  if (arm.extensible) hold_constant_lengths(arm, s.B, s.bias);
  if (!solve_inertia(s.workspace, s.B, s.bias, acceleration)) {
    for (MatrixRef* out : {&by_u, &by_velocity, &by_force}) {
      out->setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    return false;
  }
  s.slope_by_u({u.data(), velocity.data(), velocity.data(), acceleration.data()}, s.slope);
  s.C *= 2.0;  // C(u, u') u' is bilinear and symmetric in u'
  s.add_diagonal(&SegmentParameters::damping_nms_per_rad,
                 &SegmentParameters::axial_damping_ns_per_m, s.C);
  s.invert_inertia(by_force);
  of_size(s.C.rows(), [&](auto size) {
    negative_product<size()>(s.slope, by_force, by_u);
    negative_product<size()>(s.C, by_force, by_velocity);
  });
  return true;
}

void actuation_slope(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef tau_actuation_nm,
                     MatrixRef by_u) noexcept {
  by_u.setZero();
  if (arm.actuation == ActuationModel::chamber) return;
  if (arm.extensible) {
    by_u.setConstant(std::numeric_limits<double>::quiet_NaN());
    return;
  }
  for (int i = 0; i < arm.dof(); i += 2) {
    // A tau = c1 J' tau + c3 (tau x u) u with J' (x, y) = (y, -x) and tau x u = tau_y u_x - tau_x
    // u_y, where d c1 = (c3 - c2) (u . du) and d c3 = (3 c5 - c4) (u . du).
    const double x = u(i), y = u(i + 1), tau_x = tau_actuation_nm(i),
                 tau_y = tau_actuation_nm(i + 1);
    const auto c = entire<8>(x * x + y * y);
    const double across = tau_y * x - tau_x * y;
    const double on_couple = c[3] - c[2], on_axis = (3.0 * c[5] - c[4]) * across;
    const Eigen::Vector2d at_u(x, y), couple(tau_y, -tau_x);
    by_u.block<2, 2>(i, i) =
        (on_couple * couple + on_axis * at_u) * at_u.transpose() +
        c[3] * (at_u * couple.transpose() + across * Eigen::Matrix2d::Identity());
  }
}

}  // namespace softarm
