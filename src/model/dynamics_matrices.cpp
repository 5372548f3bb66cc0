#include "model/dynamics_storage.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {

void dynamics_matrices(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                       ConstVectorRef velocity, Eigen::Ref<Eigen::MatrixXd> B,
                       Eigen::Ref<Eigen::MatrixXd> C, VectorRef G) noexcept {
  auto& s = workspace.storage();
  inertia_matrix(arm, workspace, u, B);
  for (int k = 0; k < arm.dof(); ++k) {
    s.solution.setZero();
    s.solution(k) = 1.0;
    inverse_dynamics(arm, workspace, u, velocity, s.solution, s.zeros,
                     {.inertia = false, .coriolis = true, .gravity = false}, C.col(k));
  }
  inverse_dynamics(arm, workspace, u, velocity, velocity, s.zeros,
                   {.inertia = false, .coriolis = false, .gravity = true}, G);
}

void inertia_matrix(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                    Eigen::Ref<Eigen::MatrixXd> B) noexcept {
  auto& s = workspace.storage();
  for (int k = 0; k < arm.dof(); ++k) {
    s.solution.setZero();
    s.solution(k) = 1.0;
    inverse_dynamics(arm, workspace, u, s.zeros, s.zeros, s.solution,
                     {.inertia = true, .coriolis = false, .gravity = false}, B.col(k));
  }
}

}  // namespace softarm
