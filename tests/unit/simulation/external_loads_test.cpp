// Loads, payloads, a moving base and imperfect valves: every kind of plant against laws that do not
// know how it is made.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "softarm/simulation/arm_plant.hpp"
#include "softarm/simulation/mocap_simulator.hpp"
#include "softarm/simulation/plant_system.hpp"
#include "unit/simulation/paper_arm.hpp"

namespace softarm {
namespace {

PlantSettings three_segments(MakeKind kind) {
  PlantSettings settings = paper_arm(MassModel::distributed, 3);
  settings.kind = kind(3);
  set_torque_actuation(settings.actuation, 3, 10.0);
  settings.valves.supply_pressure_bar = 10.0;
  settings.arm.base_rotation =
      Eigen::AngleAxisd(2.5, Eigen::Vector3d(1.0, 0.3, 0.2).normalized()).toRotationMatrix();
  settings.initial_u_rad.setZero(6);
  settings.initial_u_rad << 0.5, -0.2, 0.3, 0.6, -0.4, 0.1;
  return settings;
}

class AllKindsUnderLoads : public ::testing::TestWithParam<MakeKind> {};
INSTANTIATE_TEST_SUITE_P(All, AllKindsUnderLoads, ::testing::Values(kPcc, kRefined, kLinks));

/// r with the load minus r without, at some state.
Eigen::VectorXd effect(const PlantSettings& with, const PlantSettings& without,
                       const Eigen::VectorXd& x, const Eigen::VectorXd& v, const Eigen::VectorXd& a,
                       double t_s = 0.0) {
  const auto loaded = with.kind.make(with), bare = without.kind.make(without);
  loaded->external_loads().enter(t_s);
  Eigen::VectorXd one(x.size()), other(x.size());
  loaded->residual(t_s, x, v, a, one);
  bare->residual(t_s, x, v, a, other);
  return one - other;
}

struct State {
  Eigen::VectorXd x, v, a;
};

State some_state(const PlantSettings& settings) {
  const auto system = settings.kind.make(settings);
  State state;
  for (Eigen::VectorXd* each : {&state.x, &state.v, &state.a}) each->setZero(system->size());
  system->spread(settings.initial_u_rad, state.x);
  for (Eigen::Index k = 0; k < system->size(); ++k) {
    state.x[k] += 0.03 * std::sin(3.0 * static_cast<double>(k));
    state.v[k] = std::cos(2.0 * static_cast<double>(k));
    state.a[k] = 5.0 * std::sin(1.0 + static_cast<double>(k));
  }
  return state;
}

/// End of a segment on the path x + t v + t^2 a / 2.
Eigen::Isometry3d end_at(const PlantSettings& settings, const State& state, std::size_t segment,
                         double t) {
  const auto system = settings.kind.make(settings);
  std::vector<Eigen::Isometry3d> ends(3);
  system->segment_ends(state.x + t * state.v + 0.5 * t * t * state.a, ends);
  return ends[segment];
}

TEST_P(AllKindsUnderLoads, LoadsDoTheWorkOfForceAndMoment) {
  const PlantSettings bare = three_segments(GetParam());
  for (int segment = 1; segment <= 3; ++segment) {
    PlantSettings loaded = bare;
    loaded.loads = {
        {.segment = segment, .force_n = {0.4, -0.7, 0.2}, .moment_nm = {0.1, 0.3, -0.2}}};
    State state = some_state(bare);
    const Eigen::VectorXd change = effect(loaded, bare, state.x, state.v, state.a);
    const auto last = static_cast<std::size_t>(segment - 1);
    const Eigen::Matrix3d here = end_at(bare, state, last, 0.0).linear();
    state.a.setZero();
    const double h = 1e-4;
    for (Eigen::Index k = 0; k < state.x.size(); ++k) {
      state.v = Eigen::VectorXd::Unit(state.x.size(), k);
      const Eigen::Isometry3d above = end_at(bare, state, last, h);
      const Eigen::Isometry3d below = end_at(bare, state, last, -h);
      const Eigen::Vector3d move = (above.translation() - below.translation()) / (2.0 * h);
      const Eigen::Matrix3d spin = (above.linear() - below.linear()) / (2.0 * h) * here.transpose();
      const Eigen::Vector3d turn(spin(2, 1), spin(0, 2), spin(1, 0));
      const double work = loaded.loads[0].force_n.dot(move) + loaded.loads[0].moment_nm.dot(turn);
      EXPECT_NEAR(-change[k], work, 1e-8) << segment << ", " << k;
    }
  }
}

TEST_P(AllKindsUnderLoads, PayloadIsMassTimesAccelerationLessGravity) {
  const PlantSettings bare = three_segments(GetParam());
  for (std::size_t segment = 0; segment < 3; ++segment) {
    PlantSettings loaded = bare;
    loaded.payload_kg.assign(3, 0.0);
    loaded.payload_kg[segment] = 0.2;
    State state = some_state(bare);
    const Eigen::VectorXd change = effect(loaded, bare, state.x, state.v, state.a);
    const double h = 1e-3;
    const auto point = [&](double t) -> Eigen::Vector3d {
      return end_at(bare, state, segment, t).translation();
    };
    const Eigen::Vector3d acceleration =
        (-point(2 * h) + 16 * point(h) - 30 * point(0.0) + 16 * point(-h) - point(-2 * h)) /
        (12 * h * h);
    const Eigen::Vector3d force = 0.2 * (acceleration - bare.arm.gravity_mps2);
    state.a.setZero();
    for (Eigen::Index k = 0; k < state.x.size(); ++k) {
      state.v = Eigen::VectorXd::Unit(state.x.size(), k);
      const Eigen::Vector3d move = (end_at(bare, state, segment, 1e-4).translation() -
                                    end_at(bare, state, segment, -1e-4).translation()) /
                                   2e-4;
      EXPECT_NEAR(change[k], force.dot(move), 1e-7) << segment << ", " << k;
    }
  }
}

TEST_P(AllKindsUnderLoads, MovingBaseIsGravityTheOtherWay) {
  PlantSettings moving = three_segments(GetParam());
  moving.payload_kg = {0.0, 0.1, 0.2};
  moving.base_motion = {.amplitude_m = {0.02, 0.0, 0.01}, .frequency_hz = 3.0, .phase_rad = 0.4};
  PlantSettings tilted = moving;
  tilted.base_motion = {};
  const double t = 0.05, rate = 6.0 * std::numbers::pi;
  tilted.arm.gravity_mps2 +=
      rate * rate * std::sin(rate * t + 0.4) * moving.base_motion.amplitude_m;
  const State state = some_state(moving);
  const Eigen::VectorXd change = effect(moving, tilted, state.x, state.v, state.a, t);
  EXPECT_LT(change.norm(), 1e-13);
}

TEST_P(AllKindsUnderLoads, AllTogetherBalanceTheirEnergies) {
  PlantSettings settings = three_segments(GetParam());
  settings.account_energy = true;
  settings.relative_tolerance = 1e-7;
  settings.absolute_tolerance = 1e-9;
  settings.payload_kg = {0.0, 0.1, 0.2};
  settings.base_motion = {.amplitude_m = {0.01, 0.0, 0.005}, .frequency_hz = 4.0, .phase_rad = 0.0};
  settings.loads = {{.segment = 2, .force_n = {0.5, 0.0, 0.0}, .start_s = 0.05, .duration_s = 0.1},
                    {.force_n = {0.0, 30.0, 0.0},
                     .shape = LoadShape::half_sine,
                     .start_s = 0.1,
                     .duration_s = 0.004},
                    {.segment = 1, .moment_nm = {0.0, 0.1, 0.1}}};
  settings.valves.slew_bar_per_s = 20.0;
  settings.valves.lag_s = 0.01;
  settings.valves.dead_time_s = 0.03;
  ArmPlant plant(settings);
  const PlantEnergies start = plant.energies();
  plant.advance(0.25, std::vector<double>{0.3, 0.1, -0.2, 0.0, 0.1, 0.4});
  const PlantEnergies end = plant.energies();
  EXPECT_NEAR(end.kinetic + end.potential - start.kinetic - start.potential,
              end.supplied - end.dissipated, 2e-6);
  EXPECT_GT(std::abs(end.supplied), 0.01);
}

TEST(ExternalLoads, ABlowIsNotSteppedOverHoweverShort) {
  PlantSettings settings = three_segments(kPcc);
  settings.arm.gravity_mps2.setZero();
  settings.initial_u_rad.setZero();
  settings.loads = {{.force_n = {5.0, 0.0, 0.0},
                     .shape = LoadShape::half_sine,
                     .start_s = 0.8,
                     .duration_s = 1e-4}};
  ArmPlant plant(settings);
  plant.advance(0.8);
  EXPECT_EQ(plant.u_rad().norm(), 0.0);
  plant.advance(0.9);
  EXPECT_GT(plant.u_rad().norm(), 1e-5);
}

TEST(ExternalLoads, RefusesWhatCannotBe) {
  const PlantSettings good = three_segments(kPcc);
  PlantSettings bad = good;
  bad.loads = {{.segment = 4}};
  EXPECT_THROW(ArmPlant{bad}, std::invalid_argument);
  bad.loads = {{.shape = LoadShape::half_sine}};
  EXPECT_THROW(ArmPlant{bad}, std::invalid_argument);
  bad = good;
  bad.payload_kg = {0.1};
  EXPECT_THROW(ArmPlant{bad}, std::invalid_argument);
  bad.payload_kg = {0.1, -0.1, 0.0};
  EXPECT_THROW(ArmPlant{bad}, std::invalid_argument);
}

TEST(ImperfectValves, DeadTimeShiftsEverythingByItself) {
  PlantSettings settings = three_segments(kPcc);
  settings.initial_u_rad.setZero();
  settings.arm.base_rotation = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  settings.valves.lag_s = 0.02;
  ArmPlant prompt(settings);
  settings.valves.dead_time_s = 0.1;
  ArmPlant late(settings);
  for (int k = 0; k < 200; ++k) {
    const std::vector<double> tau = {0.2 * std::sin(0.05 * k), 0.1, 0.0, 0.0, 0.0, 0.1};
    prompt.advance(1e-3 * (k + 1), tau);
    late.advance(1e-3 * (k + 1), tau);
    if (k < 99) {
      EXPECT_EQ(late.u_rad().norm(), 0.0);
    }
  }
  for (int k = 200; k < 300; ++k) late.advance(1e-3 * (k + 1));
  EXPECT_LT((late.u_rad() - prompt.u_rad()).norm(), 1e-6);
}

TEST(ImperfectValves, SlewThenLagIsTheSolutionOfItsEquation) {
  Valves valves({.lag_s = 0.05, .supply_pressure_bar = 3.0, .slew_bar_per_s = 10.0}, 1);
  valves.command(std::vector<double>{2.0});
  // p' = min(10, (2 - p) / 0.05): a line up to 1.5 bar at 0.15 s, the lag from there.
  Eigen::VectorXd p(1);
  valves.after(0.1, p);
  EXPECT_NEAR(p[0], 1.0, 1e-14);
  valves.after(0.25, p);
  EXPECT_NEAR(p[0], 2.0 - 0.5 * std::exp(-2.0), 1e-14);
  for (int k = 0; k < 250; ++k) valves.advance(1e-3);
  EXPECT_NEAR(valves.pressures_bar()[0], p[0], 1e-13);
  valves.command(std::vector<double>{0.0});
  valves.after(0.05, p);
  EXPECT_NEAR(p[0], valves.pressures_bar()[0] - 0.5, 1e-14);
}

TEST(ImperfectValves, SlewWithoutLagEndsAtTheCommand) {
  Valves valves({.slew_bar_per_s = 10.0}, 1);
  valves.command(std::vector<double>{1.0});
  EXPECT_EQ(valves.pressures_bar()[0], 0.0);
  valves.advance(0.05);
  EXPECT_NEAR(valves.pressures_bar()[0], 0.5, 1e-15);
  valves.advance(1.0);
  EXPECT_EQ(valves.pressures_bar()[0], 1.0);
}

TEST(ImperfectValves, SetPointsAreRounded) {
  Valves valves({.resolution_bar = 0.25}, 3);
  valves.command(std::vector<double>{0.3, 0.4, 1.99});
  EXPECT_EQ(valves.commanded_bar(), Eigen::Vector3d(0.25, 0.5, 2.0));
}

TEST(ImperfectSensing, PositionsAreRounded) {
  MocapSimulator mocap({.rate_hz = 100.0, .position_resolution_m = 0.01}, 1, 1, 0);
  Eigen::Isometry3d end = Eigen::Isometry3d::Identity();
  end.translation() = Eigen::Vector3d(0.123, -0.017, 0.5);
  mocap.capture(Eigen::Isometry3d::Identity(), std::span(&end, 1));
  MocapFrame frame;
  ASSERT_TRUE(mocap.receive(0, frame));
  EXPECT_LT((frame.body[1].position_m - Eigen::Vector3d(0.12, -0.02, 0.5)).norm(), 1e-12);
}

}  // namespace
}  // namespace softarm
