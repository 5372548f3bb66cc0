#include "softarm/model/statics.hpp"

#include <Eigen/LU>

#include "model/dynamics_storage.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/derivatives.hpp"

namespace softarm {

void gravity_moments(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                     VectorRef out) noexcept {
  // Of the motion nothing is read.
  inverse_dynamics(arm, workspace, u, u, u, u,
                   {.inertia = false, .coriolis = false, .gravity = true}, out);
}

void static_moments(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                    VectorRef out) noexcept {
  gravity_moments(arm, workspace, u, out);
  add_impedance(arm, u, workspace.storage().zeros, out);
}

Eigen::MatrixXd gravity_slope(const ArmParameters& arm, const Eigen::VectorXd& at) {
  ArmParameters limp = arm;
  for (SegmentParameters& segment : limp.segments) {
    segment.stiffness_nm_per_rad = segment.axial_stiffness_n_per_m = 0.0;
  }
  Eigen::MatrixXd slope(at.size(), at.size());
  ModelDerivatives(limp).static_stiffness(at, slope);
  return slope;
}

std::optional<Eigen::VectorXd> solve_balance(const Imbalance& imbalance, Eigen::VectorXd u) {
  constexpr double kDifference_rad = 1e-6, kLongestStep_rad = 0.5, kSmallestStep_rad = 1e-12;
  constexpr int kMostSteps = 60;
  const Eigen::Index dof = u.size();
  Eigen::VectorXd left(dof), moved(dof), left_moved(dof);
  Eigen::MatrixXd slope(dof, dof);
  for (int round = 0; round < kMostSteps; ++round) {
    imbalance(u, left);
    for (Eigen::Index j = 0; j < dof; ++j) {
      moved = u;
      moved[j] += kDifference_rad;
      imbalance(moved, left_moved);
      slope.col(j) = (left_moved - left) / kDifference_rad;
    }
    Eigen::VectorXd step = slope.partialPivLu().solve(left);
    if (!step.allFinite()) return std::nullopt;
    const double length = step.norm();
    if (length > kLongestStep_rad) step *= kLongestStep_rad / length;
    u -= step;
    if (length < kSmallestStep_rad) return u;
  }
  return std::nullopt;
}

std::optional<Eigen::VectorXd> rest_shape(const ArmParameters& arm,
                                          const Eigen::VectorXd& tau_actuation_nm) {
  DynamicsWorkspace workspace(arm);
  Eigen::VectorXd actuated(arm.dof());
  return solve_balance(
      [&](const Eigen::VectorXd& u, Eigen::VectorXd& left) {
        static_moments(arm, workspace, u, left);
        apply_actuation(arm, u, tau_actuation_nm, actuated);
        left -= actuated;
      },
      Eigen::VectorXd::Zero(arm.dof()));
}

}  // namespace softarm
