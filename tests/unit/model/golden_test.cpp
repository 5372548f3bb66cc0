// Every golden case through the library's functions, point and distributed.
#include "golden.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <vector>

#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/polar.hpp"
#include "softarm/model/segment.hpp"

namespace softarm {
namespace {

/// Every term the library offers, in the case's own coordinates.
golden::Terms evaluate(const golden::Case& c, const ArmParameters& arm) {
  const int n = arm.size(), dof = arm.dof();
  Eigen::VectorXd u = c.q, v = c.qd;
  if (c.polar) {
    polar_to_u(c.q, u);
    polar_velocity_to_u(c.q, c.qd, v);
  }
  golden::Terms out;
  std::vector<Eigen::Isometry3d> ends(static_cast<std::size_t>(n));
  forward_kinematics(arm, u, ends);
  Eigen::MatrixXd world(4, 4 * n), local(4, 4 * n);
  for (int i = 0; i < n; ++i) {
    world.middleCols<4>(4 * i) = ends[static_cast<std::size_t>(i)].matrix();
    local.middleCols<4>(4 * i).setIdentity();
    local.block<3, 3>(0, 4 * i) = segment_rotation(u.segment<2>(2 * i));
    local.block<3, 1>(0, 4 * i + 3) =
        segment_tip(arm.segments[static_cast<std::size_t>(i)].length_m, u.segment<2>(2 * i));
  }
  out["T_world"] = world;
  out["T_local"] = local;
  Eigen::Matrix3Xd centres(3, n);
  mass_centres(arm, u, centres);
  out["com_world"] = centres.transpose();
  Eigen::Matrix3Xd J(3, dof), J_rate(3, dof), J_angular(3, dof);
  tip_jacobians(arm, u, v, J, J_rate);
  tip_angular_jacobian(arm, u, J_angular);
  DynamicsWorkspace workspace(arm);
  Eigen::MatrixXd B(dof, dof), C(dof, dof);
  Eigen::VectorXd G(dof), Cv(dof);
  dynamics_matrices(arm, workspace, u, v, B, C, G);
  inverse_dynamics(arm, workspace, u, v, v, v,
                   {.inertia = false, .coriolis = true, .gravity = false}, Cv);
  out["kinetic_energy"] = Eigen::MatrixXd::Constant(1, 1, kinetic_energy(arm, workspace, u, v));
  out["gravity_potential"] = Eigen::MatrixXd::Constant(1, 1, gravity_potential(arm, u));
  if (c.polar) {
    Eigen::MatrixXd J_u = J, rate = J_rate, angular = J_angular;
    jacobian_rate_to_polar(c.q, c.qd, J_u, rate);
    jacobian_to_polar(c.q, J_u);
    jacobian_to_polar(c.q, angular);
    J = J_u;
    J_rate = rate;
    J_angular = angular;
    dynamics_to_polar(c.q, c.qd, B, C, G);
    Cv = C * c.qd;
  }
  out["J_tip"] = J;
  out["Jdot_tip"] = J_rate;
  out["Jw_tip"] = J_angular;
  out["B"] = B;
  out["C"] = C;
  out["G"] = G;
  out["Cqd"] = Cv;
  Eigen::MatrixXd couple = Eigen::MatrixXd::Zero(dof, dof), chamber = couple;
  for (int i = 0; i < dof; i += 2) {
    const Eigen::Vector2d q = c.q.segment<2>(i);
    for (const auto model : {ActuationModel::couple, ActuationModel::chamber}) {
      (model == ActuationModel::couple ? couple : chamber).block<2, 2>(i, i) =
          c.polar ? polar_actuation_matrix(model, q) : actuation_matrix(model, q);
    }
  }
  out["A_couple"] = couple;
  out["A_chamber"] = chamber;
  return out;
}

void compare(bool distributed) {
  std::map<std::string, std::pair<double, std::string>> worst;
  for (const golden::Case& c : golden::cases()) {
    const golden::Terms& expected = distributed ? c.distributed : c.expected;
    if (expected.empty()) continue;
    ArmParameters arm = c.arm;
    arm.mass = distributed ? MassModel::distributed : MassModel::point;
    const golden::Terms got = evaluate(c, arm);
    for (const auto& [key, value] : got) {
      if (!expected.contains(key)) continue;
      const double ratio = golden::error_over_tolerance(c, expected, key, value);
      // A careful double implementation is far inside; a loss of digits must show long before it
      // fails.
      EXPECT_LE(ratio, 0.05) << c.id << " " << key;
      if (ratio >= worst[key].first) worst[key] = {ratio, c.id};
    }
  }
  for (const auto& [key, value] : worst) {
    std::printf("  %-18s tolerance / error %9.1f  (%s)\n", key.c_str(), 1.0 / value.first,
                value.second.c_str());
  }
}

TEST(Golden, PointMassesWithinTolerance) { compare(false); }
TEST(Golden, DistributedMassWithinTolerance) { compare(true); }

}  // namespace
}  // namespace softarm
