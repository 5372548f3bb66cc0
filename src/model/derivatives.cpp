// For each segment j: duals along its own coordinates, from frame j outward and back to frame j;
// before it, what it passes on are tangents alone, which the segments there rotate and move as they
// do forces.
#include "softarm/model/derivatives.hpp"

#include <limits>
#include <vector>

#include "model/segment_forces.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {
namespace {

using namespace recursion;

template <bool kExtensible>
using DualLanes = LanesOf<kExtensible, std::conditional_t<kExtensible, StretchLanes, BendingLanes>>;
template <bool kExtensible>
using SegmentDual = std::conditional_t<kExtensible, StretchDual, BendingDual>;

/// Of an arm of either kind; the other one's is empty.
template <bool kExtensible>
struct Segments {
  explicit Segments(std::size_t segments)
      : lanes((segments + kLanes - 1) / kLanes),
        duals(lanes.size()),
        frames(segments),
        forces(segments) {}

  std::vector<LanesOf<kExtensible, Lanes>> lanes;
  std::vector<DualLanes<kExtensible>> duals;
  std::vector<FrameMotionOf<double>> frames;  ///< of S_{i-1}
  std::vector<ForcesOf<kExtensible, SegmentDual<kExtensible>>> forces;
};

/// What is differentiated: all of the inverse dynamics, or gravity alone, to which a mass along the
/// arc is one in its centre.
enum class Terms { all, gravity };

/// From S_{i-1} to S_i; the base neither turns nor moves.
template <Terms kTerms, class Lane, class S, class R>
void advance_frame(const Lane& k, int i, const FrameMotionOf<S>& m,
                   FrameMotionOf<R>& next) noexcept {
  const int l = lane_of(i);
  if constexpr (kTerms == Terms::gravity) {
    next.linear = rotate_back(turn(k, l), m.linear);
  } else if (i == 0) {
    advance<true>(k, l, StillFrame{}, m, next);
  } else {
    advance<true>(k, l, frame_acceleration<true>(m, k, l), m, next);
  }
}

/// What the mass of segment i does, in duals.
template <MassModel kMass, Terms kTerms, class Lane, class S, class Forces>
void segment_forces(const ArmParameters& arm, const Inputs& in, const Lane& k, int i,
                    const FrameMotionOf<S>& m, Forces& out) noexcept {
  const int l = lane_of(i);
  if constexpr (kTerms == Terms::gravity) {
    const auto force = k.mass[l] * m.linear;
    out.force = {force.x, force.y, force.z};
    point_forces(k, l, out);
    return;
  } else if (i == 0) {
    own_forces<kMass>(k, l, m.linear, StillFrame{}, out);
  } else {
    own_forces<kMass>(k, l, m.linear, frame_acceleration<true>(m, k, l), out);
  }
  const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
  if (kMass == MassModel::distributed && segment.radius_m > 0.0) {
    add_rotary_inertia<true, true>(segment, in.x + kCoordinates<Lane::kExtensible> * i, l, k, m,
                                   out);
  }
}

/// Rows of segment i in the columns of segment j.
template <bool kExtensible, class T>
void write_rows(int i, int j, const T& x, const T& y, MatrixRef& out) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  for (int e = 0; e < kWidth; ++e) {
    out(kWidth * i, kWidth * j + e) = x[e];
    out(kWidth * i + 1, kWidth * j + e) = y[e];
  }
}
template <class T>
void write_elongation(int i, int j, const T& force, MatrixRef& out) noexcept {
  for (int e = 0; e < 3; ++e) out(3 * i + 2, 3 * j + e) = force[e];
}

template <MassModel kMass, Terms kTerms, bool kExtensible>
void columns_of(const ArmParameters& arm, const Inputs& in, int j, Segments<kExtensible>& s,
                MatrixRef& out) noexcept {
  using T = SegmentDual<kExtensible>;
  const int n = arm.size();
  const auto group = [](int i) { return static_cast<std::size_t>(group_of(i)); };
  const auto index = [](int i) { return static_cast<std::size_t>(i); };
  const auto& own = s.duals[group(j)];
  segment_forces<kMass, kTerms>(arm, in, own, j, s.frames[index(j)], s.forces[index(j)]);
  FrameMotionOf<T> m;
  if (j + 1 < n) advance_frame<kTerms>(own, j, s.frames[index(j)], m);
  for (int i = j + 1; i < n; ++i) {
    const auto& k = s.lanes[group(i)];
    segment_forces<kMass, kTerms>(arm, in, k, i, m, s.forces[index(i)]);
    if (i + 1 < n) advance_frame<kTerms>(k, i, m, m);
  }

  Vec3<T> force{}, moment{};
  const auto inward = [&](int i, const auto& k) {
    const int l = lane_of(i);
    const auto& mass = s.forces[index(i)];
    force = rotate(turn(k, l), force);
    moment = rotate(turn(k, l), moment);
    const auto [x, y] = torque_from_beyond(k, l, force, moment);
    write_rows<kExtensible>(i, j, (mass.torque_x + x).d, (mass.torque_y + y).d, out);
    const auto ux = at(k.ux, l), uy = at(k.uy, l), p = at(k.tip.p, l), q = at(k.tip.q, l);
    if constexpr (kExtensible) {
      write_elongation(
          i, j, ((mass.virial + virial(ux, uy, p, q, force)) * at(k.inverse_length, l)).d, out);
    }
    const Vec3<std::remove_cv_t<decltype(p)>> tip{p * ux, p * uy, q};
    moment += mass.moment + cross(tip, force);
    force += mass.force;
  };
  for (int i = n - 1; i > j; --i) inward(i, s.lanes[group(i)]);
  inward(j, own);

  auto force_tangents = Vec3{force.x.d, force.y.d, force.z.d};
  auto moment_tangents = Vec3{moment.x.d, moment.y.d, moment.z.d};
  for (int i = j - 1; i >= 0; --i) {
    const auto& k = s.lanes[group(i)];
    const int l = lane_of(i);
    force_tangents = rotate(turn(k, l), force_tangents);
    moment_tangents = rotate(turn(k, l), moment_tangents);
    const auto [x, y] = torque_from_beyond(k, l, force_tangents, moment_tangents);
    write_rows<kExtensible>(i, j, x, y, out);
    const double ux = k.ux[l], uy = k.uy[l], p = k.tip.p[l], q = k.tip.q[l];
    if constexpr (kExtensible) {
      write_elongation(i, j, k.inverse_length[l] * virial(ux, uy, p, q, force_tangents), out);
    }
    moment_tangents += cross(Vector3{p * ux, p * uy, q}, force_tangents);
  }
}

template <MassModel kMass, Terms kTerms, bool kExtensible>
void all_columns(const ArmParameters& arm, const Inputs& in, Segments<kExtensible>& s,
                 MatrixRef& out) noexcept {
  constexpr bool kMotion = kTerms == Terms::all;
  const int n = arm.size();
  s.frames[0] = {{}, {}, {}, from_eigen(-(arm.base_rotation.transpose() * arm.gravity_mps2))};
  for (int i = 0; i < n; ++i) {
    const auto group = static_cast<std::size_t>(group_of(i));
    if (lane_of(i) == 0) {
      prepare<kMass, kMotion, kMotion>(arm, in, i, s.lanes[group]);
      prepare<kMass, kMotion, kMotion>(arm, in, i, s.duals[group]);
    }
    const auto frame = static_cast<std::size_t>(i);
    if (i + 1 < n) advance_frame<kTerms>(s.lanes[group], i, s.frames[frame], s.frames[frame + 1]);
  }
  for (int j = 0; j < n; ++j) columns_of<kMass, kTerms>(arm, in, j, s, out);
}

}  // namespace

struct ModelDerivatives::Storage {
  explicit Storage(const ArmParameters& parameters)
      : arm(parameters),
        workspace(parameters),
        bending(parameters.extensible ? 0 : parameters.segments.size()),
        stretching(parameters.extensible ? parameters.segments.size() : 0),
        bias(parameters.dof()),
        B(parameters.dof(), parameters.dof()),
        C(parameters.dof(), parameters.dof()),
        slope(parameters.dof(), parameters.dof()) {}

  template <Terms kTerms>
  void slope_by_u(const Inputs& in, MatrixRef out) noexcept {
    const bool point = kTerms == Terms::gravity || arm.mass == MassModel::point;
    if (arm.extensible) {
      const auto run = point ? all_columns<MassModel::point, kTerms, true>
                             : all_columns<MassModel::distributed, Terms::all, true>;
      run(arm, in, stretching, out);
    } else {
      const auto run = point ? all_columns<MassModel::point, kTerms, false>
                             : all_columns<MassModel::distributed, Terms::all, false>;
      run(arm, in, bending, out);
    }
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
  Segments<false> bending;
  Segments<true> stretching;
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
  storage_->slope_by_u<Terms::all>(
      {u.data(), velocity.data(), velocity.data(), acceleration.data()}, by_u);
}

void ModelDerivatives::static_stiffness(ConstVectorRef u, MatrixRef by_u) noexcept {
  storage_->slope_by_u<Terms::gravity>({u.data(), nullptr, nullptr, nullptr}, by_u);
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
  s.slope_by_u<Terms::all>({u.data(), velocity.data(), velocity.data(), acceleration.data()},
                           s.slope);
  s.C *= 2.0;  // C(u, u') u' is bilinear and symmetric in u'
  s.add_diagonal(&SegmentParameters::damping_nms_per_rad,
                 &SegmentParameters::axial_damping_ns_per_m, s.C);
  s.invert_inertia(by_force);
  by_u.noalias() = -by_force * s.slope;
  by_velocity.noalias() = -by_force * s.C;
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
