// The functions of the loop do not allocate: malloc is counted.
#include <gtest/gtest.h>

#include <vector>

#include "counted_malloc.hpp"
#include "random_arm.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/augmented_robot.hpp"
#include "softarm/model/chambers.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/polar.hpp"

namespace softarm {
namespace {

TEST(Allocation, NoneInTheAugmentedRobot) {
  if (SOFTARM_COUNTS_MALLOC == 0) GTEST_SKIP() << "a sanitizer owns malloc";
  testing_support::RandomArm random(2);
  for (const int n : {1, 5, 40}) {
    AugmentedRobot robot(random.arm(n, MassModel::point));
    Eigen::MatrixXd B_xi(10 * n, 10 * n), C_xi(10 * n, 10 * n);
    Eigen::Matrix3Xd J_xi(3, 10 * n);
    Eigen::VectorXd G_xi(10 * n);
    const Eigen::VectorXd q = random.vector(2 * n, 3.0), v = random.vector(2 * n, 2.0);
    const long before = test::allocations;
    robot.update(q, v);
    robot.rigid_dynamics(B_xi, C_xi, G_xi);
    robot.rigid_tip_jacobian(J_xi);
    EXPECT_EQ(test::allocations - before, 0) << n;
  }
}

TEST(Allocation, NoneInTheLoop) {
  if (SOFTARM_COUNTS_MALLOC == 0) GTEST_SKIP() << "a sanitizer owns malloc";
  testing_support::RandomArm random(1);
  for (const auto& kind : testing_support::kArmKinds) {
    const ArmParameters arm = random.arm(5, kind);
    DynamicsWorkspace workspace(arm);
    const auto s = random.state(arm, 3.0);
    const int dof = arm.dof();
    Eigen::VectorXd out(dof), G(dof), q(dof);
    Eigen::MatrixXd B(dof, dof), C(dof, dof);
    Eigen::Matrix3Xd J(3, dof), rate(3, dof);
    const ChamberGeometry chambers{.angles_rad = {0.0, 2.0, 4.0}};
    const double pressures[] = {0.1, 0.2, 0.3};
    std::vector<Eigen::Isometry3d> ends(5);
    SegmentVector fixed = s.u;
    const long before = test::allocations;
    for (int i = 0; i < 100; ++i) {
      inverse_dynamics(arm, workspace, fixed, s.v, s.v, s.a, {}, out);
      dynamics_matrices(arm, workspace, s.u, s.v, B, C, G);
      forward_dynamics(arm, workspace, s.u, s.v, s.a, out);
      kinetic_energy(arm, workspace, s.u, s.v);
      tip_jacobians(arm, s.u, s.v, J, rate);
      tip_angular_jacobian(arm, s.u, J);
      forward_kinematics(arm, s.u, ends);
      gravity_potential(arm, s.u);
      apply_actuation(arm, s.u, s.a, out);
      solve_actuation(arm, s.u, out, G);
      add_tip_force(arm, s.u, {0.1, 0.2, 0.3}, out);
      add_impedance(arm, s.u, s.v, out);
      out.head<3>() += chamber_force(chambers, pressures);
      if (arm.extensible) continue;  // no polar coordinates
      u_to_polar(s.u, q);
      dynamics_to_polar(q, s.v, B, C, G);
      jacobian_rate_to_polar(q, s.v, J, rate);
    }
    EXPECT_EQ(test::allocations - before, 0);
    const std::vector<int> counted(100);
    EXPECT_GT(test::allocations - before, 0) << "the counter itself must work";
  }
}

}  // namespace
}  // namespace softarm
