// Two routes to the same motion, for `evaluate`.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "softarm/control/evaluation.hpp"
#include "softarm/model/augmented_robot.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {

/// Poses, Jacobians and dynamics of the arm by one route, in the case's coordinates.
struct EvaluatedMotion {
  explicit EvaluatedMotion(const ArmParameters& arm)
      : ends(arm.segments.size()),
        local(arm.segments.size(), Eigen::MatrixXd::Identity(4, 4)),
        centres(3, arm.size()),
        J(3, arm.dof()),
        J_rate(3, arm.dof()),
        J_angular(3, arm.dof()),
        B(arm.dof(), arm.dof()),
        C(arm.dof(), arm.dof()),
        G(arm.dof()) {}

  std::vector<Eigen::Isometry3d> ends;  ///< world pose of every segment's end
  std::vector<Eigen::MatrixXd> local;   ///< the same relative to the segment's start
  Eigen::Matrix3Xd centres, J, J_rate, J_angular;
  Eigen::MatrixXd B, C;
  Eigen::VectorXd G;
  double kinetic_energy = 0.0, gravity_potential = 0.0;
};

/// By the route of the loop: in u, and from there to polar.
EvaluatedMotion direct_motion(const EvalCase& in, DynamicsWorkspace& workspace,
                              const Eigen::VectorXd& u, const Eigen::VectorXd& velocity);

/// By the rigid robot of Table I.
EvaluatedMotion augmented_motion(const EvalCase& in, AugmentedRobot& robot);

}  // namespace softarm
