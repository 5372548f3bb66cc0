// Every golden case of an arm that stretches through the library's functions, point and distributed.
#include "extensible_golden.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <vector>

#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/segment.hpp"

namespace softarm {
namespace {

golden::Terms kinematics(const golden::Case& c) {
  const ArmParameters& arm = c.arm;
  const int n = arm.size();
  golden::Terms out;
  std::vector<Eigen::Isometry3d> ends(static_cast<std::size_t>(n));
  forward_kinematics(arm, c.q, ends);
  Eigen::MatrixXd world(4, 4 * n), local(4, 4 * n);
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d q = c.q.segment<3>(3 * i);
    const double length = arm.segments[static_cast<std::size_t>(i)].length_m + q.z();
    world.middleCols<4>(4 * i) = ends[static_cast<std::size_t>(i)].matrix();
    local.middleCols<4>(4 * i).setIdentity();
    local.block<3, 3>(0, 4 * i) = segment_rotation(q.head<2>());
    local.block<3, 1>(0, 4 * i + 3) = segment_tip(length, q.head<2>());
  }
  out["T_world"] = world;
  out["T_local"] = local;
  Eigen::Matrix3Xd centres(3, n), J(3, 3 * n), J_rate(3, 3 * n), J_angular(3, 3 * n);
  mass_centres(arm, c.q, centres);
  tip_jacobians(arm, c.q, c.qd, J, J_rate);
  tip_angular_jacobian(arm, c.q, J_angular);
  out["com_world"] = centres.transpose();
  out["J_tip"] = J;
  out["Jdot_tip"] = J_rate;
  out["Jw_tip"] = J_angular;
  out["gravity_potential"] = Eigen::MatrixXd::Constant(1, 1, gravity_potential(arm, c.q));
  return out;
}

/// f of unit vectors, column by column.
template <class Function>
Eigen::MatrixXd columns_of(int dof, Function f) {
  Eigen::MatrixXd result(dof, dof);
  for (int j = 0; j < dof; ++j) {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(dof);
    f(Eigen::VectorXd::Unit(dof, j), out);
    result.col(j) = out;
  }
  return result;
}

golden::Terms constants(const golden::Case& c) {
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(c.arm.dof());
  golden::Terms out;
  out["K"] =
      columns_of(c.arm.dof(), [&](const auto& e, auto& f) { add_impedance(c.arm, e, zero, f); });
  out["D"] =
      columns_of(c.arm.dof(), [&](const auto& e, auto& f) { add_impedance(c.arm, zero, e, f); });
  out["A_chamber"] =
      columns_of(c.arm.dof(), [&](const auto& e, auto& f) { apply_actuation(c.arm, c.q, e, f); });
  return out;
}

golden::Terms dynamics(const golden::Case& c, const ArmParameters& arm) {
  const int dof = arm.dof();
  golden::Terms out;
  DynamicsWorkspace workspace(arm);
  Eigen::MatrixXd B(dof, dof), C(dof, dof);
  Eigen::VectorXd G(dof), Cqd(dof), tau(dof), tau_actuation(dof), acceleration(dof);
  dynamics_matrices(arm, workspace, c.q, c.qd, B, C, G);
  inverse_dynamics(arm, workspace, c.q, c.qd, c.qd, c.qd,
                   {.inertia = false, .coriolis = true, .gravity = false}, Cqd);
  out["B"] = B;
  out["C"] = C;
  out["G"] = G;
  out["Cqd"] = Cqd;
  out["kinetic_energy"] =
      Eigen::MatrixXd::Constant(1, 1, kinetic_energy(arm, workspace, c.q, c.qd));

  const auto& in = c.control;
  const Eigen::VectorXd reference = in.at("qbar"), velocity = in.at("qbar_dot");
  inverse_dynamics(arm, workspace, c.q, c.qd, velocity, Eigen::VectorXd(in.at("qbar_ddot")), {},
                   tau);
  add_impedance(arm, reference, velocity, tau);
  tau += in.at("KP").cwiseProduct(reference - c.q) + in.at("KD").cwiseProduct(velocity - c.qd);
  solve_actuation(arm, c.q, tau, tau_actuation);
  out["tau"] = tau;
  out["tau_A_chamber"] = tau_actuation;

  Eigen::VectorXd force(dof);
  apply_actuation(arm, c.q, Eigen::VectorXd(c.forward.at("tau_A")), force);
  add_tip_force(arm, c.q, Eigen::Vector3d(c.forward.at("f_tip")), force);
  EXPECT_TRUE(forward_dynamics(arm, workspace, c.q, c.qd, force, acceleration)) << c.id;
  out["qdd_chamber"] = acceleration;
  return out;
}

golden::Terms chambers(const golden::Case& c) {
  golden::Terms out;
  const Eigen::VectorXd pressures = c.chamber.at("pressure");
  Eigen::VectorXd force(c.arm.dof()), length(pressures.size());
  Eigen::Index first = 0;
  for (int i = 0; i < c.arm.size(); ++i) {
    const ChamberGeometry& geometry = c.chambers[static_cast<std::size_t>(i)];
    const Eigen::Vector3d q = c.q.segment<3>(3 * i);
    const std::size_t count = geometry.angles_rad.size();
    force.segment<3>(3 * i) = chamber_force(geometry, {pressures.data() + first, count});
    for (const double angle : geometry.angles_rad) {
      length(first++) = fibre_length(c.arm.segments[static_cast<std::size_t>(i)].length_m + q.z(),
                                     q.head<2>(), geometry.offset_m, angle);
    }
  }
  out["generalized_force"] = force;
  out["length"] = length;
  return out;
}

/// Where the results of each key are, and the worst error over tolerance.
class Comparison {
 public:
  void add(const golden::Case& c, const golden::Terms& basis, const golden::Terms& wanted,
           const golden::Terms& got, std::initializer_list<const char*> keys) {
    for (const std::string key : keys) {
      ASSERT_TRUE(wanted.contains(key) && got.contains(key)) << c.id << " " << key;
      const double ratio =
          golden::extensible_error_over_tolerance(c, basis, key, wanted.at(key), got.at(key));
      // A careful double implementation is far inside; a loss of digits must show long before it
      // fails.
      EXPECT_LE(ratio, 0.1) << c.id << " " << key;
      if (ratio >= worst_[key].first) worst_[key] = {ratio, c.id};
    }
  }
  void print() const {
    for (const auto& [key, value] : worst_) {
      std::printf("  %-18s error / tolerance %7.4f  (%s)\n", key.c_str(), value.first,
                  value.second.c_str());
    }
  }

 private:
  std::map<std::string, std::pair<double, std::string>> worst_;
};

TEST(ExtensibleGolden, PointMassesWithinTolerance) {
  Comparison all;
  for (const golden::Case& c : golden::extensible_cases()) {
    all.add(
        c, c.expected, c.expected, kinematics(c),
        {"T_world", "T_local", "com_world", "J_tip", "Jdot_tip", "Jw_tip", "gravity_potential"});
    all.add(c, c.expected, c.expected, constants(c), {"K", "D", "A_chamber"});
    const golden::Terms got = dynamics(c, c.arm);
    all.add(c, c.expected, c.expected, got, {"B", "C", "Cqd", "G", "kinetic_energy"});
    all.add(c, c.expected, c.control, got, {"tau", "tau_A_chamber"});
    all.add(c, c.expected, c.forward, got, {"qdd_chamber"});
    all.add(c, c.expected, c.chamber, chambers(c), {"generalized_force", "length"});
  }
  all.print();
}

TEST(ExtensibleGolden, DistributedMassWithinTolerance) {
  Comparison all;
  for (const golden::Case& c : golden::extensible_cases()) {
    ArmParameters arm = c.arm;
    arm.mass = MassModel::distributed;
    all.add(c, c.distributed, c.distributed, dynamics(c, arm),
            {"B", "C", "Cqd", "G", "kinetic_energy", "tau", "tau_A_chamber", "qdd_chamber"});
  }
  all.print();
}

}  // namespace
}  // namespace softarm
