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
  explicit EvaluatedMotion(int n)
      : ends(static_cast<std::size_t>(n)),
        local(static_cast<std::size_t>(n), Eigen::MatrixXd::Identity(4, 4)),
        centres(3, n),
        J(3, 2 * n),
        J_rate(3, 2 * n),
        J_angular(3, 2 * n),
        B(2 * n, 2 * n),
        C(2 * n, 2 * n),
        G(2 * n) {}

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
