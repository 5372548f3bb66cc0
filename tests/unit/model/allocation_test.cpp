// The functions of the loop do not allocate: malloc is counted.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <vector>

#include "random_arm.hpp"
#include "softarm/model/augmented_robot.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/polar.hpp"

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SOFTARM_COUNTS_MALLOC 1
namespace {
std::atomic<long> allocations{0};
}
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {  // operator new and Eigen both end here
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
#endif

namespace softarm {
namespace {

TEST(Allocation, NoneInTheAugmentedRobot) {
#ifdef SOFTARM_COUNTS_MALLOC
  testing_support::RandomArm random(2);
  for (const int n : {1, 5, 40}) {
    AugmentedRobot robot(random.arm(n, MassModel::point));
    Eigen::MatrixXd B_xi(10 * n, 10 * n), C_xi(10 * n, 10 * n);
    Eigen::Matrix3Xd J_xi(3, 10 * n);
    Eigen::VectorXd G_xi(10 * n);
    const Eigen::VectorXd q = random.vector(2 * n, 3.0), v = random.vector(2 * n, 2.0);
    const long before = allocations.load();
    robot.update(q, v);
    robot.rigid_dynamics(B_xi, C_xi, G_xi);
    robot.rigid_tip_jacobian(J_xi);
    EXPECT_EQ(allocations.load() - before, 0) << n;
  }
#else
  GTEST_SKIP() << "malloc belongs to the sanitizer here";
#endif
}

TEST(Allocation, NoneInTheLoop) {
#ifdef SOFTARM_COUNTS_MALLOC
  testing_support::RandomArm random(1);
  for (const auto mass : {MassModel::point, MassModel::distributed}) {
    const ArmParameters arm = random.arm(5, mass);
    DynamicsWorkspace workspace(arm);
    const auto s = random.state(5, 3.0);
    Eigen::VectorXd out(10), G(10), q(10);
    Eigen::MatrixXd B(10, 10), C(10, 10);
    Eigen::Matrix3Xd J(3, 10), rate(3, 10);
    std::vector<Eigen::Isometry3d> ends(5);
    SegmentVector fixed = s.u;
    const long before = allocations.load();
    for (int i = 0; i < 100; ++i) {
      inverse_dynamics(arm, workspace, fixed, s.v, s.v, s.a, {}, out);
      dynamics_matrices(arm, workspace, s.u, s.v, B, C, G);
      forward_dynamics(arm, workspace, s.u, s.v, s.a, out);
      kinetic_energy(arm, workspace, s.u, s.v);
      tip_jacobians(arm, s.u, s.v, J, rate);
      forward_kinematics(arm, s.u, ends);
      u_to_polar(s.u, q);
      dynamics_to_polar(q, s.v, B, C, G);
      jacobian_rate_to_polar(q, s.v, J, rate);
    }
    EXPECT_EQ(allocations.load() - before, 0);
    const std::vector<int> counted(100);
    EXPECT_GT(allocations.load() - before, 0) << "the counter itself must work";
  }
#else
  GTEST_SKIP() << "malloc belongs to the sanitizer here";
#endif
}

}  // namespace
}  // namespace softarm
