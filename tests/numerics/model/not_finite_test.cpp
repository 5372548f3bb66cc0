// NaN or infinity in any input gives NaN out, bendings of 1e8 and 1e300 give something finite or
// NaN, and every call returns.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "softarm/control/curvature_controller.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/polar.hpp"
#include "unit/model/random_arm.hpp"

namespace softarm {
namespace {

using testing_support::RandomArm;
using testing_support::State;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Outputs = std::vector<Eigen::MatrixXd>;

/// What a function does with arms that stretch; the angular Jacobian ignores e.
enum class Elongation { unsupported, ignored, read };

/// A function of u, u', and a third vector (an acceleration, a force), and which of them it reads.
struct Function {
  std::string name;
  bool reads[3];
  Elongation elongation;
  std::function<Outputs(const ArmParameters&, const State&)> call;
};

Outputs pose_of(const Eigen::Isometry3d& pose) { return {pose.matrix().topRows<3>()}; }

std::vector<Function> all_functions() {
  return {
      {"tip_pose",
       {true, false, false},
       Elongation::read,
       [](const auto& arm, const auto& s) { return pose_of(tip_pose(arm, s.u)); }},
      {"forward_kinematics",
       {true, false, false},
       Elongation::read,
       [](const auto& arm, const auto& s) {
         std::vector<Eigen::Isometry3d> ends(static_cast<std::size_t>(arm.size()));
         forward_kinematics(arm, s.u, ends);
         return pose_of(ends.back());
       }},
      {"mass_centres",
       {true, false, false},
       Elongation::read,
       [](const auto& arm, const auto& s) {
         Eigen::Matrix3Xd centres(3, arm.size());
         mass_centres(arm, s.u, centres);
         return Outputs{centres};
       }},
      {"tip_jacobians",
       {true, true, false},
       Elongation::read,
       [](const auto& arm, const auto& s) {
         Eigen::Matrix3Xd J(3, arm.dof()), rate(3, arm.dof());
         tip_jacobians(arm, s.u, s.v, J, rate);
         return Outputs{J, rate};
       }},
      {"tip_angular_jacobian",
       {true, false, false},
       Elongation::ignored,
       [](const auto& arm, const auto& s) {
         Eigen::Matrix3Xd J(3, arm.dof());
         tip_angular_jacobian(arm, s.u, J);
         return Outputs{J};
       }},
      {"inverse_dynamics",
       {true, true, true},
       Elongation::read,
       [](const auto& arm, const auto& s) {
         DynamicsWorkspace workspace(arm);
         Eigen::VectorXd out(arm.dof());
         inverse_dynamics(arm, workspace, s.u, s.v, s.v, s.a, {}, out);
         return Outputs{out};
       }},
      {"dynamics_matrices",
       {true, true, false},
       Elongation::read,
       [](const auto& arm, const auto& s) {
         DynamicsWorkspace workspace(arm);
         Eigen::MatrixXd B(arm.dof(), arm.dof()), C = B;
         Eigen::VectorXd G(arm.dof());
         dynamics_matrices(arm, workspace, s.u, s.v, B, C, G);
         return Outputs{B, C, G};
       }},
      {"forward_dynamics",
       {true, true, true},
       Elongation::read,
       [](const auto& arm, const auto& s) {
         DynamicsWorkspace workspace(arm);
         Eigen::VectorXd out = Eigen::VectorXd::Zero(arm.dof());
         forward_dynamics(arm, workspace, s.u, s.v, s.a, out);
         return Outputs{out};
       }},
      {"kinetic_energy",
       {true, true, false},
       Elongation::read,
       [](const auto& arm, const auto& s) {
         DynamicsWorkspace workspace(arm);
         return Outputs{Eigen::MatrixXd::Constant(1, 1, kinetic_energy(arm, workspace, s.u, s.v))};
       }},
      {"gravity_potential",
       {true, false, false},
       Elongation::read,
       [](const auto& arm, const auto& s) {
         return Outputs{Eigen::MatrixXd::Constant(1, 1, gravity_potential(arm, s.u))};
       }},
      {"add_tip_force",
       {true, false, false},
       Elongation::read,
       [](const auto& arm, const auto& s) {
         Eigen::VectorXd out = Eigen::VectorXd::Zero(arm.dof());
         add_tip_force(arm, s.u, {0.3, 0.2, -0.4}, out);
         return Outputs{out};
       }},
      {"solve_actuation",
       {true, false, true},
       Elongation::unsupported,
       [](ArmParameters arm, const auto& s) {
         arm.actuation = ActuationModel::couple;
         Eigen::VectorXd out(arm.dof());
         solve_actuation(arm, s.u, s.a, out);
         return Outputs{out};
       }},
      {"u_to_polar",
       {true, false, false},
       Elongation::unsupported,
       [](const auto&, const auto& s) {
         Eigen::VectorXd q(s.u.size());
         u_to_polar(s.u, q);
         return Outputs{q};
       }},
      {"polar_dynamics_matrices",
       {true, true, false},
       Elongation::unsupported,
       [](const auto& arm, const auto& s) {
         DynamicsWorkspace workspace(arm);
         Eigen::MatrixXd B(arm.dof(), arm.dof()), C = B;
         Eigen::VectorXd G(arm.dof());
         polar_dynamics_matrices(arm, workspace, s.u, s.v, B, C, G);
         return Outputs{B, C, G};
       }},
      {"polar route",
       {true, true, true},
       Elongation::unsupported,
       [](const auto& arm, const auto& s) {  // s.u is q here
         Eigen::VectorXd u(s.u.size()), v = u, a = u;
         polar_to_u(s.u, u);
         polar_velocity_to_u(s.u, s.v, v);
         polar_acceleration_to_u(s.u, s.v, s.a, a);
         DynamicsWorkspace workspace(arm);
         Eigen::VectorXd out(arm.dof());
         inverse_dynamics(arm, workspace, u, v, v, a, {}, out);
         force_to_polar(s.u, out, out);
         return Outputs{out};
       }},
      {"controller",
       {true, true, true},
       Elongation::unsupported,
       [](const auto& arm, const auto& s) {
         ControllerSettings settings;
         settings.kp.assign(static_cast<std::size_t>(arm.dof()), 1.0);
         settings.kd.assign(static_cast<std::size_t>(arm.dof()), 0.01);
         CurvatureController controller(arm, settings);
         ReferenceWindow window;
         window.now.u = SegmentVector::Constant(arm.dof(), 0.1);
         window.now.velocity = SegmentVector::Constant(arm.dof(), 0.2);
         window.now.acceleration = s.a;
         ControlOutput out;
         controller.compute(s.u, s.v, window, out);
         return Outputs{out.tau_u_nm, out.tau_actuation_nm};
       }},
  };
}

/// Those of the arm's kind.
std::vector<Function> functions(bool extensible) {
  std::vector<Function> result;
  for (const Function& f : all_functions()) {
    if (f.elongation != Elongation::unsupported || !extensible) result.push_back(f);
  }
  return result;
}

bool any_nan(const Outputs& outputs) {
  for (const auto& matrix : outputs) {
    if (matrix.array().isNaN().any()) return true;
  }
  return false;
}

class NotFinite : public ::testing::TestWithParam<testing_support::ArmKind> {};

TEST_P(NotFinite, InAnyInputGivesNanOut) {
  RandomArm random(1);
  for (const int n : {1, 2, 3, 4, 6, 9}) {
    const ArmParameters arm = random.arm(n, GetParam());
    const State good = random.state(arm, 5.0);
    for (const Function& f : functions(GetParam().extensible)) {
      ASSERT_FALSE(any_nan(f.call(arm, good))) << f.name;
      for (int which = 0; which < 3; ++which) {
        if (!f.reads[which]) continue;
        for (int k = 0; k < arm.dof(); ++k) {
          const bool is_elongation = arm.extensible && k % 3 == 2;
          if (is_elongation && f.elongation == Elongation::ignored) continue;
          for (const double poison : {kNan, -kNan, kInfinity, -kInfinity}) {
            State bad = good;
            (which == 0 ? bad.u : which == 1 ? bad.v : bad.a)(k) = poison;
            const Outputs got = f.call(arm, bad);
            bool finite = true;
            for (const auto& matrix : got) finite = finite && matrix.allFinite();
            // An infinite force or acceleration may come out as one, an infinite u as infinite
            // theta.
            const bool want_nan = std::isnan(poison) || (which == 0 && f.name != "u_to_polar");
            EXPECT_TRUE(want_nan ? any_nan(got) : !finite)
                << f.name << ", n " << n << ", input " << which << "[" << k << "] = " << poison;
          }
        }
      }
    }
  }
}

TEST_P(NotFinite, ParametersGiveNanOut) {
  RandomArm random(2);
  for (const double poison : {kNan, kInfinity}) {
    for (int which = 0; which < 3; ++which) {
      ArmParameters arm = random.arm(3, GetParam());
      if (which == 0) arm.segments[1].length_m = poison;
      if (which == 1) arm.segments[1].mass_kg = poison;
      if (which == 2) arm.gravity_mps2.x() = poison;
      DynamicsWorkspace workspace(arm);
      const State s = random.state(arm, 3.0);
      Eigen::VectorXd out(arm.dof());
      inverse_dynamics(arm, workspace, s.u, s.v, s.v, s.a, {}, out);
      EXPECT_FALSE(out.allFinite());
      out.setZero();
      forward_dynamics(arm, workspace, s.u, s.v, s.a, out);
      EXPECT_FALSE(out.allFinite());
    }
  }
}

TEST_P(NotFinite, SolverSaysNo) {
  RandomArm random(3);
  const ArmParameters arm = random.arm(3, GetParam());
  DynamicsWorkspace workspace(arm);
  State s = random.state(arm, 3.0);
  s.u(2) = kNan;
  Eigen::VectorXd out = Eigen::VectorXd::Zero(arm.dof());
  EXPECT_FALSE(forward_dynamics(arm, workspace, s.u, s.v, s.a, out));
  EXPECT_TRUE(out.array().isNaN().all());
}

TEST_P(NotFinite, HugeBendingReturns) {
  RandomArm random(4);
  for (const double theta : {20.0, 1e2, 1e4, 1e8, 1e15, 1e100, 1e154, 1e160, 1e300, 1.7e308}) {
    for (const int n : {1, 3, 5}) {
      const ArmParameters arm = random.arm(n, GetParam());
      State s = random.state(arm, 3.0);
      s.u.segment<2>(arm.segment_dof() * (n - 1)) << 0.6 * theta, -0.8 * theta;
      for (const Function& f : functions(GetParam().extensible)) {
        // Finite where the square does not overflow, NaN where it does.
        const Outputs got = f.call(arm, s);
        bool finite = true;
        for (const auto& matrix : got) finite = finite && matrix.allFinite();
        if (theta <= 1e8) {
          EXPECT_TRUE(finite) << f.name << ", theta " << theta;
        }
        EXPECT_TRUE(finite || any_nan(got)) << f.name << ", theta " << theta;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(ArmKinds, NotFinite, ::testing::ValuesIn(testing_support::kArmKinds),
                         [](const auto& kind) { return name(kind.param); });

}  // namespace
}  // namespace softarm
