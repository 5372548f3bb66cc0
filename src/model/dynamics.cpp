#include "softarm/model/dynamics.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "model/dynamics_storage.hpp"
#include "softarm/model/kinematics.hpp"

namespace softarm {

DynamicsWorkspace::Storage::Storage(const ArmParameters& arm)
    : inextensible(arm.extensible ? 0 : arm.segments.size()),
      extensible(arm.extensible ? arm.segments.size() : 0),
      zeros(Eigen::VectorXd::Zero(arm.dof())),
      bias(arm.dof()),
      scale(arm.dof()),
      rhs(arm.dof()),
      solution(arm.dof()),
      residual(arm.dof()),
      B(arm.dof(), arm.dof()),
      factor(arm.dof(), arm.dof()) {}

DynamicsWorkspace::DynamicsWorkspace(const ArmParameters& arm) {
  if (arm.segments.empty()) {
    throw std::invalid_argument("DynamicsWorkspace: expected at least one segment, got 0");
  }
  storage_ = std::make_unique<Storage>(arm);
}
DynamicsWorkspace::~DynamicsWorkspace() = default;
DynamicsWorkspace::DynamicsWorkspace(DynamicsWorkspace&&) noexcept = default;
DynamicsWorkspace& DynamicsWorkspace::operator=(DynamicsWorkspace&&) noexcept = default;

namespace {

/// L L' = A in the lower triangle of A, in place. False where a pivot is not positive (a NaN is
/// not).
bool cholesky(Eigen::Ref<Eigen::MatrixXd> A) noexcept {
  const Eigen::Index n = A.rows();
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index k = 0; k < j; ++k) {
      const double factor = A(j, k);
      for (Eigen::Index i = j; i < n; ++i) A(i, j) -= A(i, k) * factor;
    }
    if (!(A(j, j) > 0.0) || !std::isfinite(A(j, j))) return false;
    const double pivot = std::sqrt(A(j, j));
    for (Eigen::Index i = j; i < n; ++i) A(i, j) /= pivot;
  }
  return true;
}

/// x := (L L')^-1 x.
void substitute(const Eigen::Ref<const Eigen::MatrixXd>& L,
                Eigen::Ref<Eigen::VectorXd> x) noexcept {
  const Eigen::Index n = L.rows();
  for (Eigen::Index j = 0; j < n; ++j) {
    x(j) /= L(j, j);
    for (Eigen::Index i = j + 1; i < n; ++i) x(i) -= L(i, j) * x(j);
  }
  for (Eigen::Index j = n - 1; j >= 0; --j) {
    for (Eigen::Index i = j + 1; i < n; ++i) x(j) -= L(i, j) * x(i);
    x(j) /= L(j, j);
  }
}

}  // namespace

void hold_constant_lengths(const ArmParameters& arm, Eigen::Ref<Eigen::MatrixXd> B,
                           VectorRef force) noexcept {
  for (int i = 0; i < arm.size(); ++i) {
    if (!arm.segments[static_cast<std::size_t>(i)].constant_length) continue;
    const int e = 3 * i + 2;
    B.row(e).setZero();
    B.col(e).setZero();
    B(e, e) = 1.0;
    force(e) = 0.0;
  }
}

bool solve_inertia(DynamicsWorkspace& workspace, const Eigen::Ref<const Eigen::MatrixXd>& B,
                   ConstVectorRef rhs, VectorRef x) noexcept {
  auto& s = workspace.storage();
  const Eigen::Index n = B.rows();
  // Unit diagonal: segments of very different mass, or polar's theta^2 rows, must not decide the
  // rounding.
  for (Eigen::Index i = 0; i < n; ++i) s.scale(i) = 1.0 / std::sqrt(B(i, i));
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i < n; ++i) s.factor(i, j) = B(i, j) * s.scale(i) * s.scale(j);
    s.rhs(j) = rhs(j) * s.scale(j);
    s.solution(j) = s.rhs(j);
  }
  if (!cholesky(s.factor)) {
    x.setConstant(std::numeric_limits<double>::quiet_NaN());
    return false;
  }
  substitute(s.factor, s.solution);
  for (Eigen::Index i = 0; i < n; ++i) {
    long double sum = s.rhs(i);
    for (Eigen::Index j = 0; j < n; ++j) {
      sum -= static_cast<long double>(B(i, j) * s.scale(i) * s.scale(j)) * s.solution(j);
    }
    s.residual(i) = static_cast<double>(sum);
  }
  substitute(s.factor, s.residual);
  for (Eigen::Index i = 0; i < n; ++i) x(i) = (s.solution(i) + s.residual(i)) * s.scale(i);
  return true;
}

bool forward_dynamics(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                      ConstVectorRef velocity, ConstVectorRef generalized_force,
                      VectorRef acceleration) noexcept {
  auto& s = workspace.storage();
  inertia_matrix(arm, workspace, u, s.B);
  inverse_dynamics(arm, workspace, u, velocity, velocity, s.zeros,
                   {.inertia = false, .coriolis = true, .gravity = true}, s.bias);
  add_impedance(arm, u, velocity, s.bias);
  s.bias = generalized_force - s.bias;
  if (arm.extensible) hold_constant_lengths(arm, s.B, s.bias);
  return solve_inertia(workspace, s.B, s.bias, acceleration);
}

double kinetic_energy(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                      ConstVectorRef velocity) noexcept {
  auto& s = workspace.storage();
  inverse_dynamics(arm, workspace, u, s.zeros, s.zeros, velocity,
                   {.inertia = true, .coriolis = false, .gravity = false}, s.bias);
  return 0.5 * velocity.dot(s.bias);
}

void add_impedance(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef velocity,
                   VectorRef generalized_force) noexcept {
  Eigen::Index k = 0;
  for (const SegmentParameters& segment : arm.segments) {
    for (const Eigen::Index end = k + 2; k < end; ++k) {
      generalized_force(k) +=
          segment.stiffness_nm_per_rad * u(k) + segment.damping_nms_per_rad * velocity(k);
    }
    if (!arm.extensible) continue;
    generalized_force(k) +=
        segment.axial_stiffness_n_per_m * u(k) + segment.axial_damping_ns_per_m * velocity(k);
    ++k;
  }
}

}  // namespace softarm
