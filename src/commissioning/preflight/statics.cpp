#include "commissioning/preflight/statics.hpp"

#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {

bool curvature_of(const Experiment& experiment, const MeanPoses& poses, Eigen::VectorXd& u_rad) {
  const int n = experiment.arm.size();
  const CurvatureEstimator estimator(experiment.estimation, experiment.arm,
                                     body_noise(experiment.estimation, n));
  u_rad.setZero(2 * n);
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (!poses.body[k].valid || !poses.body[k + 1].valid) return false;
    const SegmentCurvature one = estimator.segment(i, poses.body[k], poses.body[k + 1]);
    if (!one.valid) return false;
    u_rad.segment<2>(2 * i) = one.u_rad;
  }
  return true;
}

Eigen::VectorXd static_force_nm(const ArmParameters& arm, const Eigen::VectorXd& u_rad) {
  DynamicsWorkspace workspace(arm);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(arm.dof());
  Eigen::VectorXd force_nm(arm.dof());
  inverse_dynamics(arm, workspace, u_rad, zero, zero, zero,
                   {.inertia = false, .coriolis = false, .gravity = true}, force_nm);
  add_impedance(arm, u_rad, zero, force_nm);
  return force_nm;
}

}  // namespace softarm
