// The simulated arm against laws and other routes: energy, symmetry, statics, a classical
// Runge-Kutta method.
#include "softarm/simulation/arm_plant.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/statics.hpp"
#include "unit/simulation/paper_arm.hpp"

namespace softarm {
namespace {

using Eigen::VectorXd;

VectorXd bent() {
  VectorXd u(6);
  u << 0.6, 0.1, -0.4, 0.5, 0.2, -0.7;
  return u;
}

/// K u + G(u) - force at rest, from the model.
VectorXd static_residual(const ArmParameters& arm, const VectorXd& u, const VectorXd& force) {
  DynamicsWorkspace workspace(arm);
  VectorXd out(arm.dof());
  static_moments(arm, workspace, u, out);
  return out - force;
}

/// Classical Runge-Kutta of order 4 on forward dynamics, with constant force: another route than
/// the plant's.
VectorXd runge_kutta(const ArmParameters& arm, VectorXd u, VectorXd v, const VectorXd& force,
                     double duration_s, int steps) {
  DynamicsWorkspace workspace(arm);
  const double h = duration_s / steps;
  VectorXd a1(u.size()), a2(u.size()), a3(u.size()), a4(u.size());
  for (int k = 0; k < steps; ++k) {
    forward_dynamics(arm, workspace, u, v, force, a1);
    const VectorXd u2 = u + h / 2 * v, v2 = v + h / 2 * a1;
    forward_dynamics(arm, workspace, u2, v2, force, a2);
    const VectorXd u3 = u + h / 2 * v2, v3 = v + h / 2 * a2;
    forward_dynamics(arm, workspace, u3, v3, force, a3);
    const VectorXd u4 = u + h * v3, v4 = v + h * a3;
    forward_dynamics(arm, workspace, u4, v4, force, a4);
    u += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  return u;
}

TEST(ArmPlant, FreeDecayAgreesWithAnotherIntegratorAndConverges) {
  const PlantSettings settings = paper_arm();
  const VectorXd expected =
      runge_kutta(settings.arm, bent(), VectorXd::Zero(6), VectorXd::Zero(6), 0.5, 10000);
  double previous = INFINITY;
  for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
    PlantSettings toleranced = settings;
    toleranced.initial_u_rad = bent();
    toleranced.relative_tolerance = tolerance;
    toleranced.absolute_tolerance = 1e-2 * tolerance;
    ArmPlant plant(toleranced);
    plant.advance(0.5);
    const double error = (VectorXd(plant.u_rad()) - expected).lpNorm<Eigen::Infinity>();
    EXPECT_LT(error, 100.0 * tolerance);
    EXPECT_LT(error, 0.2 * previous);
    previous = error;
  }
}

TEST(ArmPlant, ForceStepsThroughIdealValvesAgreeWithAnotherIntegrator) {
  const PlantSettings settings = paper_arm();
  ArmPlant plant(settings);
  const std::vector<double> pressures = drive_bar(0.7);
  plant.advance(0.3, pressures);
  const VectorXd force = chamber_force_nm(settings, plant.pressures_bar());
  const VectorXd expected =
      runge_kutta(settings.arm, VectorXd::Zero(6), VectorXd::Zero(6), force, 0.3, 6000);
  EXPECT_GT(expected.norm(), 0.1);
  EXPECT_LT((VectorXd(plant.u_rad()) - expected).lpNorm<Eigen::Infinity>(), 1e-5);
}

class EnergyBalance : public ::testing::TestWithParam<MassModel> {};

TEST_P(EnergyBalance, ClosesOverADrivenRun) {
  for (const double tolerance : {1e-5, 1e-7}) {
    PlantSettings settings = paper_arm(GetParam());
    settings.valves.lag_s = 0.02;
    settings.tip_force_n = {0.3, -0.1, 0.2};
    settings.initial_u_rad = bent();
    settings.account_energy = true;
    settings.relative_tolerance = tolerance;
    settings.absolute_tolerance = 1e-2 * tolerance;
    ArmPlant plant(settings);
    const PlantEnergies start = plant.energies();
    double worst = 0.0;
    for (int k = 0; k < 500; ++k) {
      plant.advance(2e-3 * (k + 1), drive_bar(2e-3 * k));
      const PlantEnergies now = plant.energies();
      const double stored = now.kinetic + now.potential - start.kinetic - start.potential;
      worst = std::max(worst, std::abs(stored - (now.supplied - now.dissipated)));
    }
    EXPECT_GT(plant.energies().dissipated, 0.05);
    EXPECT_GT(std::abs(plant.energies().supplied), 0.05);
    EXPECT_LT(worst, 20.0 * tolerance);
  }
}

TEST_P(EnergyBalance, WithoutDampingOrInputEnergyStays) {
  PlantSettings settings = paper_arm(GetParam(), 2);
  for (SegmentParameters& segment : settings.arm.segments) segment.damping_nms_per_rad = 0.0;
  settings.initial_u_rad = bent().head(4);
  settings.relative_tolerance = 1e-8;
  settings.absolute_tolerance = 1e-10;
  ArmPlant plant(settings);
  const PlantEnergies start = plant.energies();
  double kinetic = 0.0;
  for (int k = 1; k <= 50; ++k) {
    plant.advance(0.01 * k);
    const PlantEnergies now = plant.energies();
    kinetic = std::max(kinetic, now.kinetic);
    EXPECT_NEAR(now.kinetic + now.potential, start.kinetic + start.potential, 1e-5);
  }
  EXPECT_GT(kinetic, 0.05);
}

INSTANTIATE_TEST_SUITE_P(Masses, EnergyBalance,
                         ::testing::Values(MassModel::point, MassModel::distributed));

TEST(ArmPlant, MotionInAPlaneStaysInIt) {
  PlantSettings settings = paper_arm();
  settings.initial_u_rad = bent();
  for (int i = 0; i < 3; ++i) settings.initial_u_rad[2 * i + 1] = 0.0;
  ArmPlant plant(settings);
  for (int k = 1; k <= 100; ++k) {
    plant.advance(0.01 * k);
    for (int i = 0; i < 3; ++i) EXPECT_LT(std::abs(plant.u_rad()[2 * i + 1]), 1e-14);
  }
}

TEST(ArmPlant, AStraightHangingArmStaysStraight) {
  ArmPlant plant(paper_arm());
  plant.advance(5.0);
  EXPECT_LT(plant.u_rad().norm(), 1e-14);
}

TEST(ArmPlant, TurningEverythingAboutTheAxisTurnsTheMotion) {
  for (const ActuationModel actuation : {ActuationModel::chamber, ActuationModel::couple}) {
    PlantSettings settings = paper_arm();
    settings.arm.actuation = actuation;
    settings.initial_u_rad = bent();
    PlantSettings turned = settings;
    for (int i = 0; i < 3; ++i) {  // a quarter turn moves chamber j to where j + 1 was
      turned.initial_u_rad.segment<2>(2 * i) << -bent()[2 * i + 1], bent()[2 * i];
    }
    ArmPlant one(settings);
    ArmPlant two(turned);
    for (int k = 0; k < 200; ++k) {
      const std::vector<double> p = drive_bar(2e-3 * k + 0.5);
      std::vector<double> q(p);
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 4; ++j) q[4 * i + (j + 1) % 4] = p[4 * i + j];
      }
      one.advance(2e-3 * (k + 1), p);
      two.advance(2e-3 * (k + 1), q);
    }
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(two.u_rad()[2 * i], -one.u_rad()[2 * i + 1], 1e-5);
      EXPECT_NEAR(two.u_rad()[2 * i + 1], one.u_rad()[2 * i], 1e-5);
    }
  }
}

TEST(ArmPlant, SettlesWhereForcesBalance) {
  PlantSettings settings = paper_arm();
  settings.valves.lag_s = 0.02;
  settings.tip_force_n = {0.2, 0.3, -0.1};
  ArmPlant plant(settings);
  plant.advance(12.0, drive_bar(1.3));
  EXPECT_LT(plant.velocity_radps().norm(), 1e-4);
  const VectorXd u = plant.u_rad();
  EXPECT_GT(u.norm(), 0.2);
  Eigen::Matrix3Xd jacobian(3, 6);
  tip_jacobian(settings.arm, u, jacobian);
  const VectorXd force = chamber_force_nm(settings, plant.commanded_bar()) +
                         jacobian.transpose() * settings.tip_force_n;
  EXPECT_LT(static_residual(settings.arm, u, force).lpNorm<Eigen::Infinity>(), 2e-5);
}

TEST(ArmPlant, CoupleActuationGoesThroughItsOwnMatrix) {
  PlantSettings settings = paper_arm();
  settings.arm.actuation = ActuationModel::couple;
  ArmPlant plant(settings);
  plant.advance(12.0, drive_bar(1.3));
  const VectorXd u = plant.u_rad();
  const VectorXd chambers = chamber_force_nm(settings, plant.pressures_bar());
  VectorXd force(6);
  for (int i = 0; i < 3; ++i) {
    // Moments about the local axes: the chambers' force in u is [[0, 1], [-1, 0]] times them.
    const Eigen::Vector2d tau(-chambers[2 * i + 1], chambers[2 * i]);
    const double x = u[2 * i], y = u[2 * i + 1], theta = std::hypot(x, y);
    const double c1 = std::sin(theta) / theta, c3 = (theta - std::sin(theta)) / std::pow(theta, 3);
    Eigen::Matrix2d a;  // model.md section 6
    a << -c3 * x * y, c1 + c3 * x * x, -c1 - c3 * y * y, c3 * x * y;
    force.segment<2>(2 * i) = a * tau;
  }
  EXPECT_LT(static_residual(settings.arm, u, force).lpNorm<Eigen::Infinity>(), 2e-5);
  VectorXd tau(6);
  for (int i = 0; i < 3; ++i) tau.segment<2>(2 * i) << -chambers[2 * i + 1], chambers[2 * i];
  EXPECT_LT((rest_shape(settings.arm, tau).value() - u).norm(), 1e-4);
  EXPECT_GT(static_residual(settings.arm, u, chambers).norm(), 1e-3);
}

TEST(ArmPlant, ThreePointMassSegmentsStayStableUnderSteps) {
  PlantSettings settings = paper_arm(MassModel::point);
  ArmPlant plant(settings);
  for (int k = 0; k < 200; ++k) {  // rates of 4e5 1/s excited every 5 ms
    const std::vector<double> pressures = k % 2 == 0 ? drive_bar(1.0) : drive_bar(2.0);
    plant.advance(5e-3 * (k + 1), pressures);
    ASSERT_LT(plant.u_rad().lpNorm<Eigen::Infinity>(), 3.0);
    ASSERT_LT(plant.velocity_radps().lpNorm<Eigen::Infinity>(), 100.0);
  }
  plant.advance(15.0, drive_bar(1.0));
  const VectorXd force = chamber_force_nm(settings, plant.pressures_bar());
  EXPECT_LT(static_residual(settings.arm, plant.u_rad(), force).lpNorm<Eigen::Infinity>(), 2e-5);
  EXPECT_EQ(plant.counters().retries, 0);
}

TEST(ArmPlant, SameCallsSameBits) {
  const auto run = [] {
    PlantSettings settings = paper_arm(MassModel::point);
    settings.valves.lag_s = 0.02;
    ArmPlant plant(settings);
    for (int k = 0; k < 300; ++k) plant.advance(1e-3 * (k + 1), drive_bar(1e-3 * k));
    VectorXd state(12);
    state << VectorXd(plant.u_rad()), VectorXd(plant.velocity_radps());
    return state;
  };
  const VectorXd one = run();
  EXPECT_EQ(one, run());
}

TEST(ArmPlant, HowTimeIsCutDoesNotMatter) {
  PlantSettings settings = paper_arm();
  settings.valves.lag_s = 0.02;
  ArmPlant whole(settings);
  ArmPlant cut(settings);
  whole.advance(0.4, drive_bar(1.0));
  cut.command(drive_bar(1.0));
  for (int k = 1; k <= 1000; ++k) cut.advance(0.4e-3 * k);
  EXPECT_LT((whole.u_rad() - cut.u_rad()).norm(), 1e-5);
  EXPECT_LT((whole.pressures_bar() - cut.pressures_bar()).norm(), 1e-12);
}

TEST(ArmPlant, ReportsPosesOfItsState) {
  PlantSettings settings = paper_arm();
  settings.arm.base_position_m = {1.0, 2.0, 3.0};
  settings.initial_u_rad = bent();
  const ArmPlant plant(settings);
  std::vector<Eigen::Isometry3d> ends(3);
  plant.segment_ends(ends);
  EXPECT_LT((ends[2].translation() - plant.tip_m()).norm(), 1e-15);
  EXPECT_EQ(plant.base().translation(), settings.arm.base_position_m);
  EXPECT_EQ(plant.base().linear(), settings.arm.base_rotation);
  EXPECT_EQ(plant.chambers(), 12);
  EXPECT_EQ(plant.segments(), 3);
}

TEST(ArmPlant, ResetPutsItElsewhereAndStartsTheAccountsAgain) {
  PlantSettings settings = paper_arm();
  settings.account_energy = true;
  ArmPlant plant(settings);
  plant.advance(0.1, drive_bar(1.0));
  const std::vector<double> pressures(12, 0.1);
  plant.reset(bent(), VectorXd::Zero(6), pressures);
  EXPECT_EQ(plant.time_s(), 0.1);
  EXPECT_EQ(VectorXd(plant.u_rad()), bent());
  EXPECT_EQ(plant.pressures_bar()[3], 0.1);
  EXPECT_EQ(plant.energies().supplied, 0.0);
  plant.advance(0.2);
  // Equal pressures all around do nothing.
  const VectorXd expected =
      runge_kutta(settings.arm, bent(), VectorXd::Zero(6), VectorXd::Zero(6), 0.1, 2000);
  EXPECT_LT((VectorXd(plant.u_rad()) - expected).norm(), 1e-5);
  EXPECT_THROW(plant.reset(VectorXd::Zero(4), VectorXd::Zero(6), pressures), std::invalid_argument);
  EXPECT_THROW(plant.reset(bent() * NAN, VectorXd::Zero(6), pressures), std::invalid_argument);
}

TEST(ArmPlant, AToleranceThatCannotBeMetIsAnErrorAndThePlantStaysWhereItWas) {
  PlantSettings settings = paper_arm();
  settings.initial_u_rad = bent();
  settings.relative_tolerance = 1e-40;
  settings.absolute_tolerance = 1e-40;
  ArmPlant plant(settings);
  try {
    plant.advance(0.1, drive_bar(1.0));
    FAIL() << "expected a PlantError";
  } catch (const PlantError& error) {
    EXPECT_FALSE(error.cause.empty());
    EXPECT_EQ(error.u_rad.size(), 6);
    EXPECT_NE(std::string(error.what()).find("t = 0.0"), std::string::npos) << error.what();
  }
  EXPECT_EQ(plant.time_s(), 0.0);
  EXPECT_EQ(VectorXd(plant.u_rad()), bent());
}

TEST(ArmPlant, RefusesSettingsThatDescribeNoArm) {
  const auto build = [](auto change) {
    PlantSettings settings = paper_arm();
    change(settings);
    ArmPlant{settings};
  };
  EXPECT_NO_THROW(build([](auto&) {}));
  EXPECT_THROW(build([](auto& s) { s.arm.segments.clear(); }), std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.actuation.segments.pop_back(); }), std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.arm.segments[1].mass_kg = 0.0; }), std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.arm.segments[1].length_m = NAN; }), std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.arm.segments[0].damping_nms_per_rad = -1.0; }),
               std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.initial_u_rad.setZero(4); }), std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.tip_force_n[0] = NAN; }), std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.relative_tolerance = 0.0; }), std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.absolute_tolerance = -1.0; }), std::invalid_argument);
  EXPECT_THROW(build([](auto& s) { s.valves.lag_s = NAN; }), std::invalid_argument);
}

}  // namespace
}  // namespace softarm
