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
      inverse_pivots(arm.dof()),
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

/// L D L' = A, in place: L below the diagonal (where it is 1), 1 / D in `inverse`. The upper
/// triangle stays. False where a pivot is not positive (a NaN is not).
///
/// Nothing is scaled: without a choice of pivots an entry's rounding is relative to
/// sqrt(a_ii a_jj) whatever the units of its rows, so segments of very different mass, or polar's
/// theta^2 rows, do not decide it (Demmel, LAPACK working note 14, 1989).
template <int kSize>
bool factorize(Eigen::Index size, double* __restrict a, double* __restrict inverse) noexcept {
  const Eigen::Index n = kSize > 0 ? kSize : size;
#pragma GCC unroll 9
  for (Eigen::Index j = 0; j < n; ++j) {
    const double pivot = a[j + j * n];
    if (!(pivot > 0.0) || !std::isfinite(pivot)) return false;
    const double inverse_pivot = inverse[j] = 1.0 / pivot;
#pragma GCC unroll 9
    for (Eigen::Index k = j + 1; k < n; ++k) {
      const double factor = a[k + j * n] * inverse_pivot;
#pragma GCC unroll 9
      for (Eigen::Index i = k; i < n; ++i) a[i + k * n] -= a[i + j * n] * factor;
    }
#pragma GCC unroll 9
    for (Eigen::Index i = j + 1; i < n; ++i) a[i + j * n] *= inverse_pivot;
  }
  return true;
}

/// x := (L D L')^-1 x.
template <int kSize>
void substitute(Eigen::Index size, const double* __restrict l, const double* __restrict inverse,
                double* __restrict x) noexcept {
  const Eigen::Index n = kSize > 0 ? kSize : size;
#pragma GCC unroll 9
  for (Eigen::Index j = 0; j < n; ++j) {
    const double known = x[j];
#pragma GCC unroll 9
    for (Eigen::Index i = j + 1; i < n; ++i) x[i] -= l[i + j * n] * known;
  }
#pragma GCC unroll 9
  for (Eigen::Index j = n - 1; j >= 0; --j) {
    double sum = x[j] * inverse[j];
#pragma GCC unroll 9
    for (Eigen::Index i = j + 1; i < n; ++i) sum -= l[i + j * n] * x[i];
    x[j] = sum;
  }
}

/// out = (L D L')^-1 from V = L^-T, both without a sum over a row: what is added to stands side by side.
template <int kSize>
void invert(Eigen::Index size, const double* __restrict l, const double* __restrict inverse,
            double* __restrict v, double* __restrict out, Eigen::Index stride) noexcept {
  const Eigen::Index n = kSize > 0 ? kSize : size;
#pragma GCC unroll 9
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) out[j + i * stride] = v[j + i * n] = 0.0;
    v[i + i * n] = 1.0;
#pragma GCC unroll 9
    for (Eigen::Index k = 0; k < i; ++k) {
      const double factor = l[i + k * n];
#pragma GCC unroll 9
      for (Eigen::Index j = 0; j <= k; ++j) v[j + i * n] -= v[j + k * n] * factor;
    }
  }
#pragma GCC unroll 9
  for (Eigen::Index k = 0; k < n; ++k) {
#pragma GCC unroll 9
    for (Eigen::Index j = 0; j <= k; ++j) {
      const double factor = v[j + k * n] * inverse[k];
#pragma GCC unroll 9
      for (Eigen::Index i = 0; i <= j; ++i) out[i + j * stride] += v[i + k * n] * factor;
    }
  }
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i < j; ++i) out[j + i * stride] = out[i + j * stride];
  }
}

/// s.solution + s.residual is B^-1 rhs.
template <int kSize>
bool solve(const Eigen::Ref<const Eigen::MatrixXd>& B, ConstVectorRef rhs,
           DynamicsWorkspace::Storage& s) noexcept {
  const Eigen::Index n = kSize > 0 ? kSize : B.rows();
  double *const factor = s.factor.data(), *const inverse = s.inverse_pivots.data();
  double *const x = s.solution.data(), *const residual = s.residual.data();
  const double *const b = B.data(), *const right = rhs.data();
  const Eigen::Index stride = B.outerStride();
  for (Eigen::Index j = 0; j < n; ++j) {
#pragma GCC unroll 9
    for (Eigen::Index i = 0; i < n; ++i) factor[i + j * n] = b[i + j * stride];
    x[j] = right[j];
  }
  if (!factorize<kSize>(n, factor, inverse)) return false;
  substitute<kSize>(n, factor, inverse, x);
  for (Eigen::Index i = 0; i < n; ++i) {
    long double sum = right[i];
#pragma GCC unroll 9
    for (Eigen::Index j = 0; j < n; ++j) sum -= static_cast<long double>(b[j + i * stride]) * x[j];
    residual[i] = static_cast<double>(sum);
  }
  substitute<kSize>(n, factor, inverse, residual);
  return true;
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
  const auto run = of_size(B.rows(), [](auto size) { return solve<size()>; });
  if (!run(B, rhs, s)) {
    x.setConstant(std::numeric_limits<double>::quiet_NaN());
    return false;
  }
  x = s.solution + s.residual;
  return true;
}

void inverse_of_last_inertia(DynamicsWorkspace& workspace,
                             Eigen::Ref<Eigen::MatrixXd> out) noexcept {
  auto& s = workspace.storage();
  const auto run = of_size(out.rows(), [](auto size) { return invert<size()>; });
  run(out.rows(), s.factor.data(), s.inverse_pivots.data(), s.B.data(), out.data(),
      out.outerStride());
}

bool forward_dynamics(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                      ConstVectorRef velocity, ConstVectorRef generalized_force,
                      VectorRef acceleration) noexcept {
  auto& s = workspace.storage();
  inverse_dynamics(arm, workspace, u, velocity, velocity, s.zeros,
                   {.inertia = false, .coriolis = true, .gravity = true}, s.bias);
  inertia_of_last_shape(arm, workspace, s.B);
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
