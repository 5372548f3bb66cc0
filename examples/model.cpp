// The model of an arm: where its tip is, and the terms of B u'' + C u' + D u' + G + K u = A tau_A
// (16).
#include <iostream>
#include <softarm/model/dynamics.hpp>
#include <softarm/model/kinematics.hpp>

int main() {
  softarm::ArmParameters arm;  // hangs from a ceiling; lengths in m, masses in kg, moments in N m
  arm.segments.assign(3, {.length_m = 0.11, .mass_kg = 0.15, .stiffness_nm_per_rad = 0.626});
  softarm::DynamicsWorkspace workspace(arm);
  const Eigen::VectorXd u =
      Eigen::VectorXd::Constant(arm.dof(), 0.3);  // theta [cos phi, sin phi] in rad
  const Eigen::VectorXd velocity = Eigen::VectorXd::Zero(arm.dof());  // u' in rad/s
  Eigen::MatrixXd B(arm.dof(), arm.dof()), C(arm.dof(), arm.dof());
  Eigen::VectorXd G(arm.dof());
  softarm::dynamics_matrices(arm, workspace, u, velocity, B, C, G);
  std::cout << "tip [m]: " << softarm::tip_position(arm, u).transpose() << "\nB [kg m^2]:\n"
            << B << "\nG [N m]: " << G.transpose() << '\n';
}
