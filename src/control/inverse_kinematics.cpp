#include "softarm/control/inverse_kinematics.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace softarm {
namespace {

/// Cofactors and determinant of the symmetric M: three by three, no iteration, no branch.
struct SymmetricInverse {
  Eigen::Matrix3d adjugate;
  double determinant;

  explicit SymmetricInverse(const Eigen::Matrix3d& M) noexcept {
    for (int i = 0; i < 3; ++i) {
      adjugate.col(i) = M.col((i + 1) % 3).cross(M.col((i + 2) % 3));
    }
    determinant = M.col(0).dot(adjugate.col(0));
  }
  Eigen::Vector3d times(const Eigen::Vector3d& v) const noexcept {
    return adjugate * v / determinant;
  }
};

}  // namespace

double manipulability_ratio(const Eigen::Ref<const Eigen::Matrix3Xd>& jacobian) noexcept {
  const Eigen::Matrix3d M = jacobian * jacobian.transpose();
  const double mean = M.trace() / 3.0;
  return SymmetricInverse(M).determinant / (mean * mean * mean);
}

Eigen::Matrix3d damped_inverse(const Eigen::Ref<const Eigen::Matrix3Xd>& jacobian,
                               double hard_mprad) noexcept {
  const Eigen::Matrix3d M = jacobian * jacobian.transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(M);
  const double h = 0.25 * hard_mprad * hard_mprad;
  Eigen::Vector3d f;
  for (int i = 0; i < 3; ++i) {
    const double x = std::max(eigen.eigenvalues()[i], 0.0);  // J J' has none below 0 but round-off
    const double missing = std::max(1.0 - x / (4.0 * h), 0.0);
    f[i] = 1.0 / (x + h * missing * missing);
  }
  return eigen.eigenvectors() * f.asDiagonal() * eigen.eigenvectors().transpose();
}

bool inverse_kinematics(const InverseKinematicsGains& gains,
                        const Eigen::Ref<const Eigen::Matrix3Xd>& jacobian,
                        const Eigen::Ref<const Eigen::Matrix3Xd>& jacobian_rate,
                        ConstVectorRef velocity, const Eigen::Vector3d& tip_position_m,
                        const TipReference& reference, VectorRef velocity_reference,
                        VectorRef acceleration_reference) noexcept {
  Eigen::Matrix3d M = jacobian * jacobian.transpose();
  M.diagonal().array() += gains.damping_mprad * gains.damping_mprad;
  const SymmetricInverse inverse(M);
  const double mean = M.trace() / 3.0;
  if (!(inverse.determinant > kMinManipulabilityRatio * mean * mean * mean)) {
    velocity_reference.setZero();
    acceleration_reference.setZero();
    return false;
  }
  const Eigen::Vector3d position_error = reference.position_m - tip_position_m;
  const Eigen::Vector3d velocity_error = reference.velocity_mps - jacobian * velocity;
  const Eigen::Vector3d tip_velocity = reference.velocity_mps + gains.lambda_1ps * position_error;
  const Eigen::Vector3d tip_acceleration =
      reference.acceleration_mps2 + gains.lambda_velocity_1ps * velocity_error +
      gains.lambda_position_1ps2 * position_error - jacobian_rate * velocity;
  velocity_reference.noalias() = jacobian.transpose() * inverse.times(tip_velocity);
  acceleration_reference.noalias() = jacobian.transpose() * inverse.times(tip_acceleration);
  return true;
}

}  // namespace softarm
