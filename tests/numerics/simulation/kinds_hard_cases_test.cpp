// The hard cases once more on arms of pieces and of links, and those that need dead time or blows.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "numerics/simulation/balanced_run.hpp"
#include "softarm/simulation/arm_plant.hpp"
#include "unit/simulation/paper_arm.hpp"

namespace softarm {
namespace {

struct KindCase {
  const char* name;
  PlantSettings settings;
  double duration_s = 0.3;
  std::vector<double> pressures;  // held from the start; empty: none
};

void PrintTo(const KindCase& example, std::ostream* out) { *out << example.name; }

PlantSettings arm_of(MakeKind kind, int segments, int parts, double bend_rad = 0.0) {
  PlantSettings settings = paper_arm(MassModel::distributed, segments);
  settings.kind = kind(parts);
  settings.initial_u_rad.setZero(2 * segments);
  for (int i = 0; i < segments; ++i) {
    settings.initial_u_rad[2 * i] = bend_rad * std::cos(0.7 * i);
    settings.initial_u_rad[2 * i + 1] = bend_rad * std::sin(0.7 * i);
  }
  return settings;
}

PlantSettings with_blow(PlantSettings settings) {
  settings.loads = {{.force_n = {20.0, 5.0, 0.0},
                     .shape = LoadShape::half_sine,
                     .start_s = 0.1,
                     .duration_s = 0.005}};
  return settings;
}

PlantSettings with_dead_time(PlantSettings settings) {
  settings.valves.dead_time_s = 0.1;
  return settings;
}

/// One segment with a moment that bends it beyond pi.
PlantSettings by_torque(MakeKind kind, int parts) {
  PlantSettings settings = arm_of(kind, 1, parts);
  set_torque_actuation(settings.actuation, 1, 10.0);
  settings.valves.supply_pressure_bar = 10.0;
  return settings;
}

/// The arm of section VI: 24 links, 1 m, 1 kg.
PlantSettings section_six(MassModel mass = MassModel::distributed) {
  PlantSettings settings = arm_of(kLinks, 4, 6, 0.6);
  settings.arm.mass = mass;
  settings.arm.segments.assign(
      4,
      {.length_m = 0.25, .mass_kg = 0.25, .stiffness_nm_per_rad = 2.0, .damping_nms_per_rad = 0.5});
  return settings;
}

std::vector<double> one_side(int segments) {
  std::vector<double> pressures(static_cast<std::size_t>(4 * segments), 0.0);
  for (std::size_t i = 0; i < pressures.size(); i += 4) pressures[i] = 2.0;
  return pressures;
}

std::vector<KindCase> kind_cases() {
  return {
      {"refined_release_from_2_rad", arm_of(kRefined, 3, 4, 2.0), 0.3, {}},
      {"links_release_from_2_rad", arm_of(kLinks, 3, 6, 2.0), 0.3, {}},
      {"refined_a_fiftieth_of_the_damping",
       with_damping(arm_of(kRefined, 2, 4, 0.5), 0.02),
       0.2,
       {}},
      {"links_a_fiftieth_of_the_damping", with_damping(arm_of(kLinks, 2, 6, 0.5), 0.02), 0.2, {}},
      {"refined_two_bar_on_one_side", arm_of(kRefined, 3, 4), 0.3, one_side(3)},
      {"links_two_bar_on_one_side", arm_of(kLinks, 3, 6), 0.3, one_side(3)},
      {"pcc_blow", with_blow(arm_of(kPcc, 3, 1)), 0.3, {}},
      {"refined_blow", with_blow(arm_of(kRefined, 3, 4)), 0.3, {}},
      {"links_blow", with_blow(arm_of(kLinks, 3, 6)), 0.3, {}},
      {"pcc_dead_time", with_dead_time(arm_of(kPcc, 3, 1)), 0.3, one_side(3)},
      {"links_dead_time", with_dead_time(arm_of(kLinks, 3, 6)), 0.3, one_side(3)},
      {"refined_through_pi", by_torque(kRefined, 6), 0.5, {0.0, 2.4}},
      {"links_through_pi", by_torque(kLinks, 6), 0.5, {0.0, 2.4}},
      {"stretching_refined_release_from_2_rad", stretching(arm_of(kRefined, 3, 4, 2.0)), 0.3, {}},
      {"stretching_refined_two_bar_on_one_side", stretching(arm_of(kRefined, 2, 4)), 0.3,
       one_side(2)},
      {"stretching_links_release_from_2_rad", stretching(arm_of(kLinks, 3, 6, 2.0)), 0.3, {}},
      {"stretching_links_two_bar_on_one_side", stretching(arm_of(kLinks, 3, 6)), 0.3, one_side(3)},
      {"stretching_links_blow", with_blow(stretching(arm_of(kLinks, 3, 6))), 0.3, {}},
      {"twenty_four_links", section_six(), 0.5, one_side(4)},
      {"twenty_four_point_links", section_six(MassModel::point), 0.5, one_side(4)},
  };
}

Outcome run(const KindCase& example, IntegratorMethod method, double relative, double absolute) {
  PlantSettings settings = example.settings;
  settings.method = method;
  settings.relative_tolerance = relative;
  settings.absolute_tolerance = absolute;
  return balanced_run(settings, example.pressures, example.duration_s, 20);
}

class KindsHardCases : public ::testing::TestWithParam<KindCase> {};

TEST_P(KindsHardCases, AgreeWithATightRunAndBalanceTheirEnergies) {
  const KindCase& example = GetParam();
  const Outcome normal = run(example, IntegratorMethod::cash4, 2e-8, 2e-9);
  const Outcome tight = run(example, IntegratorMethod::cash4, 3e-10, 3e-11);
  const double error = (normal.u - tight.u).lpNorm<Eigen::Infinity>();
  std::printf("[ measured ] error %.1e rad, imbalance %.1e J (tight %.1e J), %ld and %ld steps\n",
              error, normal.imbalance_j, tight.imbalance_j,
              static_cast<long>(normal.counters.steps), static_cast<long>(tight.counters.steps));
  EXPECT_LT(error, 1e-5);
  EXPECT_LT(normal.imbalance_j, 1e-4);
  EXPECT_LT(tight.imbalance_j, 1e-6);
  EXPECT_EQ(normal.counters.retries, 0);
  EXPECT_EQ(tight.counters.retries, 0);
}

INSTANTIATE_TEST_SUITE_P(Plant, KindsHardCases, ::testing::ValuesIn(kind_cases()),
                         [](const auto& example) { return std::string(example.param.name); });

TEST(LinksPlant, AreDrivenThroughPiWithoutNoticing) {
  PlantSettings settings = arm_of(kLinks, 1, 6);
  settings.arm.gravity_mps2.setZero();
  set_torque_actuation(settings.actuation, 1, 10.0);
  settings.valves.supply_pressure_bar = 10.0;
  settings.relative_tolerance = 1e-5;
  settings.absolute_tolerance = 1e-6;
  ArmPlant plant(settings);
  double previous = 0.0;
  double largest = 0.0;
  for (int k = 0; k < 500; ++k) {
    const double tau = 1.25 * (1.0 - std::cos(2.0 * std::numbers::pi * k * 2e-3));
    plant.advance(2e-3 * (k + 1), std::vector<double>{0.0, tau});
    const double theta = plant.u_rad().norm();
    EXPECT_LT(std::abs(theta - previous), 0.2);
    previous = theta;
    largest = std::max(largest, theta);
  }
  EXPECT_GT(largest, 1.1 * std::numbers::pi);
}

TEST(LinksPlant, AFailureStatesTimeStateAndCause) {
  PlantSettings settings = section_six();
  ArmPlant plant(settings);
  plant.advance(0.01);
  const Eigen::VectorXd before = plant.coordinates();
  SegmentVector u = plant.u_rad();
  u.setConstant(std::nan(""));
  EXPECT_THROW(plant.reset(u, u, std::vector<double>(16, 0.0)), std::invalid_argument);
  EXPECT_EQ(plant.coordinates(), before);
  // A velocity whose square is no number.
  u.setZero();
  SegmentVector velocity = u;
  velocity.setConstant(1e200);
  plant.reset(u, velocity, std::vector<double>(16, 0.0));
  try {
    plant.advance(0.02);
    FAIL() << "it integrated what cannot be";
  } catch (const PlantError& error) {
    EXPECT_EQ(error.time_s, 0.01);
    EXPECT_FALSE(error.cause.empty());
    EXPECT_EQ(error.u_rad.size(), plant.dof());
  }
  EXPECT_EQ(plant.time_s(), 0.01);
}

}  // namespace
}  // namespace softarm
