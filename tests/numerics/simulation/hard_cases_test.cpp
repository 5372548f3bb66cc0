// Cases that break explicit methods, loose tolerances and naive starts; each against a tighter run
// and by its energies.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "numerics/simulation/balanced_run.hpp"
#include "softarm/simulation/arm_plant.hpp"
#include "unit/simulation/paper_arm.hpp"

namespace softarm {
namespace {

struct Case {
  const char* name;
  PlantSettings settings;
  double duration_s = 1.0;
  std::vector<double> pressures;  // held from the start
  double error_rad = 1e-5;        // at a relative tolerance of 1e-6
  double default_error_rad = 1e-3;
};

void PrintTo(const Case& example, std::ostream* out) { *out << example.name; }

PlantSettings released(double bend_rad, MassModel mass, int segments = 3) {
  PlantSettings settings = paper_arm(mass, segments);
  settings.initial_u_rad.setZero(2 * segments);
  for (int i = 0; i < segments; ++i) {
    settings.initial_u_rad[2 * i] = bend_rad * std::cos(0.7 * i);
    settings.initial_u_rad[2 * i + 1] = bend_rad * std::sin(0.7 * i);
  }
  return settings;
}

std::vector<double> one_side(double pressure_bar, int segments) {
  std::vector<double> pressures(static_cast<std::size_t>(4 * segments), 0.0);
  for (std::size_t i = 0; i < pressures.size(); i += 4) pressures[i] = pressure_bar;
  return pressures;
}

std::vector<Case> cases() {
  const auto none = [](int n) { return std::vector<double>(static_cast<std::size_t>(4 * n), 0.0); };
  PlantSettings impact = released(0.3, MassModel::distributed);
  impact.tip_force_n = {20.0, 0.0, 0.0};
  PlantSettings standing = released(0.01, MassModel::distributed);
  standing.arm.base_rotation.setIdentity();
  return {
      {"release_from_2_rad", released(2.0, MassModel::distributed), 1.0, none(3)},
      {"release_from_2_rad_point", released(2.0, MassModel::point), 1.0, none(3)},
      {"a_fiftieth_of_the_damping", with_damping(released(0.5, MassModel::distributed), 0.02), 0.5,
       none(3), 1e-4},
      {"two_bar_on_one_side", paper_arm(), 1.0, one_side(2.0, 3)},
      {"two_bar_on_one_side_point", paper_arm(MassModel::point), 1.0, one_side(2.0, 3)},
      {"six_point_masses", released(0.5, MassModel::point, 6), 1.0, none(6)},
      {"ten_segments", released(0.3, MassModel::distributed, 10), 1.0, none(10)},
      {"a_blow_on_the_tip", impact, 1.0, none(3)},
      {"standing_arm", standing, 1.0, none(3)},
      {"stretching_release_from_2_rad", stretching(released(2.0, MassModel::distributed)), 1.0,
       none(3)},
      {"stretching_release_from_2_rad_point", stretching(released(2.0, MassModel::point)), 1.0,
       none(3)},
      {"stretching_two_bar_on_one_side", stretching(paper_arm()), 1.0, one_side(2.0, 3)},
      {"stretching_two_bar_on_one_side_point", stretching(paper_arm(MassModel::point)), 1.0,
       one_side(2.0, 3)},
      {"stretching_a_blow_on_the_tip", stretching(impact), 1.0, none(3)},
      {"stretching_a_fiftieth_of_the_damping",
       with_damping(stretching(released(0.5, MassModel::distributed)), 0.02), 0.5, none(3), 1e-4},
  };
}

Outcome run(const Case& example, double relative_tolerance, double absolute_tolerance) {
  PlantSettings settings = example.settings;
  settings.relative_tolerance = relative_tolerance;
  settings.absolute_tolerance = absolute_tolerance;
  return balanced_run(settings, example.pressures, example.duration_s, 50);
}

/// As integrated by default.
Outcome run_by_default(const Case& example) {
  const PlantSettings defaults;
  PlantSettings settings = example.settings;
  settings.method = defaults.method;
  settings.relative_tolerance = defaults.relative_tolerance;
  settings.absolute_tolerance = defaults.absolute_tolerance;
  settings.max_step_s = defaults.max_step_s;
  return balanced_run(settings, example.pressures, example.duration_s, 50);
}

class HardCases : public ::testing::TestWithParam<Case> {};

TEST_P(HardCases, AgreeWithATightRunAndBalanceTheirEnergies) {
  const Case& example = GetParam();
  const Outcome normal = run(example, 1e-6, 1e-8);
  const Outcome by_default = run_by_default(example);
  const Outcome tight = run(example, 1e-9, 1e-11);
  const double error = (normal.x - tight.x).lpNorm<Eigen::Infinity>();
  EXPECT_LT(error, example.error_rad);
  EXPECT_LT(normal.imbalance_j, 1e-4);
  EXPECT_LT(tight.imbalance_j, 1e-6);
  EXPECT_EQ(normal.counters.retries, 0);
  EXPECT_EQ(tight.counters.retries, 0);
  const double default_error = (by_default.x - tight.x).lpNorm<Eigen::Infinity>();
  EXPECT_LT(default_error, example.default_error_rad);
  EXPECT_EQ(by_default.counters.retries, 0);
  std::printf(
      "[ measured ] error %.1e rad, imbalance %.1e J (tight %.1e J), %ld steps; by default "
      "%.1e rad, %.1e J, %ld steps\n",
      error, normal.imbalance_j, tight.imbalance_j, static_cast<long>(normal.counters.steps),
      default_error, by_default.imbalance_j, static_cast<long>(by_default.counters.steps));
}

INSTANTIATE_TEST_SUITE_P(Plant, HardCases, ::testing::ValuesIn(cases()),
                         [](const auto& example) { return std::string(example.param.name); });

TEST(Plant, IsDrivenThroughPiWithoutNoticing) {
  PlantSettings settings = paper_arm(MassModel::distributed, 1);
  settings.actuation.max_pressure_bar = 10.0;
  settings.valves = {.lag_s = 0.02, .supply_pressure_bar = 10.0};
  ArmPlant plant(settings);
  double largest = 0.0;
  double previous = 0.0;
  for (int k = 0; k < 1000; ++k) {
    const double pressure = 3.2 * (1.0 - std::cos(2.0 * std::numbers::pi * k * 1e-3));
    plant.advance(1e-3 * (k + 1), std::vector<double>{pressure, 0.0, 0.0, 0.0});
    const double theta = plant.u_rad().norm();
    EXPECT_LT(std::abs(theta - previous), 0.2);
    previous = theta;
    largest = std::max(largest, theta);
  }
  EXPECT_GT(largest, 1.1 * std::numbers::pi);
}

TEST(Plant, HeldCommandsConvergeWithTheTolerance) {
  for (const MassModel mass : {MassModel::point, MassModel::distributed}) {
    const auto drive = [&](double tolerance) {
      PlantSettings settings = paper_arm(mass);
      settings.valves.lag_s = 0.02;
      settings.relative_tolerance = tolerance;
      settings.absolute_tolerance = 1e-2 * tolerance;
      ArmPlant plant(settings);
      Eigen::MatrixXd trace(6, 100);
      for (int k = 0; k < 1000; ++k) {
        plant.advance(1e-3 * (k + 1), drive_bar(1e-3 * k));
        if (k % 10 == 9) trace.col(k / 10) = plant.u_rad();
      }
      return trace;
    };
    const Eigen::MatrixXd reference = drive(1e-11);
    const double coarse = (drive(1e-4) - reference).lpNorm<Eigen::Infinity>();
    const double normal = (drive(1e-6) - reference).lpNorm<Eigen::Infinity>();
    const double fine = (drive(1e-8) - reference).lpNorm<Eigen::Infinity>();
    EXPECT_LT(coarse, 1e-4);
    EXPECT_LT(normal, 1e-5);
    EXPECT_LT(fine, 3e-7);
    EXPECT_LT(fine, normal);
  }
}

}  // namespace
}  // namespace softarm
