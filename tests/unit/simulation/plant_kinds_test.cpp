// What every kind of simulated arm has to do alike, and how they approach one another.
#include <gtest/gtest.h>

#include <numbers>

#include "softarm/simulation/arm_plant.hpp"
#include "unit/simulation/paper_arm.hpp"

namespace softarm {
namespace {

PlantSettings by_torque(MakeKind kind, int segments, int parts) {
  PlantSettings settings = paper_arm(MassModel::distributed, segments);
  settings.kind = kind(parts);
  set_torque_actuation(settings.actuation, segments, 10.0);
  settings.valves.supply_pressure_bar = 10.0;
  return settings;
}

std::vector<double> drive_nm(double t, int segments) {
  std::vector<double> tau;
  for (int i = 0; i < segments; ++i) {
    tau.push_back(0.25 * std::sin(3.0 * t + i));
    tau.push_back(0.2 * std::sin(2.0 * t));
  }
  return tau;
}

Eigen::VectorXd run(ArmPlant& plant, double duration_s, double hold_s = 1e-2) {
  while (plant.time_s() < duration_s - 1e-9) {
    const double t = plant.time_s();
    plant.advance(t + hold_s, drive_nm(t, plant.segments()));
  }
  return plant.u_rad();
}

class Kinds : public ::testing::TestWithParam<MakeKind> {};
INSTANTIATE_TEST_SUITE_P(All, Kinds, ::testing::Values(kPcc, kRefined, kLinks));

TEST_P(Kinds, EnergyBalanceClosesOverADrivenRun) {
  for (const ActuationModel model : {ActuationModel::chamber, ActuationModel::couple}) {
    PlantSettings settings = by_torque(GetParam(), 2, 4);
    settings.arm.actuation = model;
    settings.account_energy = true;
    settings.relative_tolerance = 1e-8;
    settings.absolute_tolerance = 1e-10;
    settings.valves.lag_s = 0.02;
    settings.tip_force_n = {0.1, 0.05, 0.0};
    ArmPlant plant(settings);
    const PlantEnergies start = plant.energies();
    run(plant, 0.5);
    const PlantEnergies end = plant.energies();
    EXPECT_GT(end.dissipated, 1e-4);
    EXPECT_NEAR(end.kinetic + end.potential - start.kinetic - start.potential,
                end.supplied - end.dissipated, 1e-6 * end.dissipated);
  }
}

TEST_P(Kinds, StraightHangingArmStaysExactlyStraight) {
  ArmPlant plant(by_torque(GetParam(), 3, 4));
  plant.advance(1.0);
  EXPECT_EQ(plant.coordinates(), Eigen::VectorXd::Zero(plant.dof()));
  EXPECT_EQ(plant.coordinate_rates(), Eigen::VectorXd::Zero(plant.dof()));
}

TEST_P(Kinds, MomentsInAPlaneNeverLeaveIt) {
  ArmPlant plant(by_torque(GetParam(), 3, 4));
  for (int k = 0; k < 50; ++k) {
    const double tau = 0.3 * std::sin(0.3 * k);
    plant.advance(0.01 * (k + 1), std::vector<double>{0.0, tau, 0.0, -tau, 0.0, tau});
  }
  EXPECT_GT(std::abs(plant.u_rad()[0]), 1e-3);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(plant.u_rad()[2 * i + 1], 0.0);
}

TEST_P(Kinds, FastDriveOfFourSegmentsMeetsATighterRun) {
  PlantSettings settings = by_torque(GetParam(), 4, 6);
  ArmPlant plant(settings);
  settings.relative_tolerance = 1e-9;
  settings.absolute_tolerance = 1e-11;
  ArmPlant reference(settings);
  EXPECT_LT((run(plant, 0.5) - run(reference, 0.5)).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_EQ(plant.counters().retries, 0);
}

TEST_P(Kinds, SegmentEndsAgreeWithTheTipAndTheFit) {
  PlantSettings settings = by_torque(GetParam(), 3, 4);
  ArmPlant plant(settings);
  run(plant, 0.3);
  std::vector<Eigen::Isometry3d> ends(3);
  plant.segment_ends(ends);
  EXPECT_EQ(ends[2].translation(), plant.tip_m());
  SegmentVector u, velocity;
  plant.curvature(u, velocity);
  EXPECT_EQ(u, plant.u_rad());
  EXPECT_EQ(velocity, plant.velocity_radps());
}

TEST(PlantKinds, OnePieceIsTheModel) {
  ArmPlant pcc(by_torque(kPcc, 3, 1));
  ArmPlant refined(by_torque(kRefined, 3, 1));
  EXPECT_EQ(run(pcc, 0.2), run(refined, 0.2));
}

TEST(PlantKinds, TorquesDoWhatChambersWithTheSameMomentsDo) {
  PlantSettings settings = paper_arm(MassModel::distributed, 2);
  ArmPlant chambers(settings);
  ArmPlant torque(by_torque(kPcc, 2, 1));
  const double gain = settings.actuation.segments[0][0].gain_nm_per_bar;
  // A chamber at chi adds -g p (cos chi, sin chi) to the force in u: tau_A = (g p sin, -g p cos).
  const std::vector<double> pressures = {0.3, 0.0, 0.0, 0.1, 0.0, 0.2, 0.4, 0.0};
  chambers.advance(0.3, pressures);
  torque.advance(0.3, std::vector<double>{-gain * 0.1, -gain * 0.3, gain * 0.2, gain * 0.4});
  EXPECT_LT((chambers.u_rad() - torque.u_rad()).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(PlantKinds, TorqueIsBoundedOnBothSidesAndNaNIsZero) {
  PlantSettings settings = by_torque(kPcc, 1, 1);
  ArmPlant plant(settings);
  plant.command(std::vector<double>{-20.0, std::nan("")});
  EXPECT_EQ(plant.commanded_bar(), Eigen::Vector2d(-10.0, 0.0));
}

/// A uniform moment on one segment: many parts come ever nearer one another.
TEST(PlantKinds, PiecesConvergeQuadratically) {
  const auto tip = [](int pieces) {
    PlantSettings settings = by_torque(kRefined, 1, pieces);
    settings.initial_u_rad = Eigen::Vector2d(0.8, 0.0);
    settings.relative_tolerance = 1e-8;
    settings.absolute_tolerance = 1e-10;
    ArmPlant plant(settings);
    plant.advance(0.05);
    return plant.tip_m();
  };
  const Eigen::Vector3d finest = tip(32);
  const double of_4 = (tip(4) - finest).norm(), of_8 = (tip(8) - finest).norm();
  EXPECT_NEAR(of_4 / of_8, 4.2, 0.4);  // (1 / 16 - 1 / 1024) / (1 / 64 - 1 / 1024)
}

TEST(PlantKinds, WeightsKeepLengthMassAndTheBendUnderAUniformMoment) {
  PlantSettings settings = by_torque(kRefined, 1, 3);
  RefinedSettings kind = {.pieces = 3,
                          .length_weights = {1.0, 2.0, 1.0},
                          .mass_weights = {3.0, 2.0, 1.0},
                          .rigidity_weights = {4.0, 2.0, 1.0}};
  settings.kind = kind;
  settings.arm.gravity_mps2.setZero();
  settings.initial_u_rad = Eigen::Vector2d(0.5, 0.0);
  ArmPlant plant(settings);
  // The share of each piece is its length over its rigidity: 1/4, 2/2, 1/1 of their sum.
  const Eigen::VectorXd x = plant.coordinates();
  EXPECT_NEAR(x[0], 0.5 * 0.25 / 2.25, 1e-15);
  EXPECT_NEAR(x[2], 0.5 * 1.0 / 2.25, 1e-15);
  EXPECT_NEAR(x[4], 0.5 * 1.0 / 2.25, 1e-15);
  // tau_y = k u holds it where it is.
  plant.advance(0.5, std::vector<double>{0.0, 0.626 * 0.5});
  EXPECT_LT((plant.coordinates() - x).norm(), 1e-9);
  EXPECT_NEAR(plant.u_rad()[0], 0.5, 1e-9);

  for (const auto& weights : {std::vector{1.0, 2.0}, {1.0, 2.0, -1.0}}) {
    kind.mass_weights = weights;
    settings.kind = kind;
    EXPECT_THROW(ArmPlant{settings}, std::invalid_argument);
  }
  settings.kind = kRefined(1000);
  EXPECT_THROW(ArmPlant{settings}, std::invalid_argument);
}

TEST(PlantKinds, SeparateJointValuesReplaceThoseOfTheSegment) {
  PlantSettings settings = by_torque(kLinks, 1, 6);
  settings.arm.gravity_mps2.setZero();
  settings.kind = LinkSettings{
      .links_per_segment = 6, .joint_stiffness_nm_per_rad = 12.0, .joint_damping_nms_per_rad = 3.0};
  ArmPlant plant(settings);
  plant.advance(10.0, std::vector<double>{0.6, -0.3});
  for (int j = 0; j < 6; ++j) {
    EXPECT_NEAR(plant.coordinates()[2 * j], 0.05, 1e-7);
    EXPECT_NEAR(plant.coordinates()[2 * j + 1], -0.025, 1e-7);
  }
}

}  // namespace
}  // namespace softarm
