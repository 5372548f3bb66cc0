// The check of the whole loop against simulations with noise: they lose stability together.
#include "softarm/commissioning/loop_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <ostream>
#include <string>

#include "softarm/config/load.hpp"
#include "softarm/simulation/lock_step.hpp"

namespace softarm {
namespace {

Experiment paper_arm() {
  Experiment e = load_experiment(SOFTARM_SOURCE_DIR "/config/paper_arm.yaml");
  // A pose that bends all segments: where the moments grow, it stays within reach of the chambers.
  e.reference.phases = {{SetPointReference{{0.2, 0.1, 0.2, -0.1, 0.1, 0.1}}, 0.0}};
  return e;
}

Experiment tip_arm() {
  Experiment e = paper_arm();
  TipPathReference circle;
  circle.shape = TipPathShape::circle;
  circle.centre_m = {0.0, 0.0, -0.29};
  circle.first_axis_m = {0.04, 0.0, 0.0};
  circle.second_axis_m = {0.0, 0.04, 0.0};
  circle.rate_radps = 1.0;
  e.reference.phases = {{circle, 0.0}};
  return e;
}

void set_kp(Experiment& e, double kp) { e.control.kp.assign(e.control.kp.size(), kp); }

Experiment with_gain(Experiment e, double factor) {
  for (auto& chambers : e.plant.actuation.segments)
    for (Chamber& chamber : chambers) chamber.gain_nm_per_bar *= factor;
  return e;
}

Experiment with_payload(Experiment e, double factor) {
  e.plant.payload_kg.back() = 0.01 * factor;
  return e;
}

/// The factor at which `stable` ends, within 1 %.
double boundary(const std::function<bool(double)>& stable) {
  double low = 0.2, high = 12.0;
  if (!stable(low)) return 0.0;
  if (stable(high)) return high;
  while (high > 1.01 * low) {
    const double middle = std::sqrt(low * high);
    (stable(middle) ? low : high) = middle;
  }
  return low;
}

/// Whether a run with all its noise is still ACTIVE after a minute: otherwise it vented for an
/// oscillation, or for a soft limit on its way there.
bool stays_active(const Experiment& experiment) {
  LockStep steps(experiment, experiment.plant);
  LogRow row;
  bool was_active = false;
  for (std::int64_t k = 0; k < std::llround(60.0 * experiment.rate_hz); ++k) {
    steps.step(row, false);
    const bool active = steps.pipeline().output().mode == Mode::active;
    if (was_active && !active) return false;
    was_active = active;
  }
  return was_active;
}

struct MapPoint {
  const char* name;
  Experiment (*base)();
  std::function<void(Experiment&)> change;
  Experiment (*scale)(Experiment, double factor);
};
void PrintTo(const MapPoint& point, std::ostream* out) { *out << point.name; }

class LoopCheckMap : public ::testing::TestWithParam<MapPoint> {};

TEST_P(LoopCheckMap, PredictionAndSimulationLoseStabilityTogether) {
  const MapPoint& point = GetParam();
  Experiment experiment = point.base();
  point.change(experiment);
  const double predicted = boundary(
      [&](double factor) { return disturbance_growth_1ps(point.scale(experiment, factor)) < 0.0; });
  const double simulated =
      boundary([&](double factor) { return stays_active(point.scale(experiment, factor)); });
  EXPECT_GT(simulated, 0.3);
  EXPECT_LT(simulated, 12.0);
  EXPECT_NEAR(predicted, simulated, 0.05 * simulated);
}

INSTANTIATE_TEST_SUITE_P(
    Map, LoopCheckMap,
    ::testing::Values(
        MapPoint{"kp_1", paper_arm, [](Experiment&) {}, with_gain},
        MapPoint{"kp_0_5", paper_arm, [](Experiment& e) { set_kp(e, 0.5); }, with_gain},
        MapPoint{"payload", paper_arm, [](Experiment& e) { e.plant.payload_kg.back() = 0.1; },
                 with_gain},
        MapPoint{"dead_time", paper_arm, [](Experiment& e) { e.plant.valves.dead_time_s = 0.01; },
                 with_gain},
        MapPoint{"lag_40_ms", paper_arm,
                 [](Experiment& e) { e.plant.valves.lag_s = e.control.valve_lag_s = 0.04; },
                 with_gain},
        MapPoint{"ki_3", paper_arm,
                 [](Experiment& e) { e.control.ki.assign(e.control.ki.size(), 3.0); }, with_gain},
        MapPoint{"tip", tip_arm, [](Experiment&) {}, with_gain},
        MapPoint{"fast_tip", tip_arm,
                 [](Experiment& e) {
                   e.control.task_space = {6.0, 10.0, 2.0, 0.0};
                 },
                 with_payload}),
    [](const auto& each) { return std::string(each.param.name); });

TEST(LoopCheck, WhatIsShippedIsStableAndAHugeIntegralGainIsNot) {
  Experiment experiment = paper_arm();
  const LoopCheck good = check_loop(experiment);
  EXPECT_TRUE(loop_warnings(good).empty());
  EXPECT_GE(good.configured.gain, good.worst.gain);
  EXPECT_GT(good.worst.gain, 1.25);
  experiment.control.ki.assign(experiment.control.ki.size(), 500.0);
  const LoopCheck bad = check_loop(experiment);
  EXPECT_FALSE(loop_warnings(bad).empty());
  EXPECT_EQ(bad.worst.gain, 0.0);
}

TEST(LoopCheck, WithoutFeedbackADisturbanceFadesAsTheArmDoes) {
  Experiment experiment = on_declared_arm(paper_arm());
  set_kp(experiment, 0.0);
  experiment.control.kd.assign(experiment.control.kd.size(), 0.0);
  experiment.control.terms.gravity = false;
  experiment.arm.gravity_mps2.setZero();
  experiment.plant.arm.gravity_mps2.setZero();
  const double growth = disturbance_growth_1ps(experiment);
  // Twice the damping, twice the rate, as long as the arm swings.
  for (SegmentParameters& segment : experiment.plant.arm.segments)
    segment.damping_nms_per_rad *= 2.0;
  EXPECT_LT(growth, -0.5);
  EXPECT_NEAR(disturbance_growth_1ps(experiment), 2.0 * growth, 0.1 * std::abs(2.0 * growth));
}

}  // namespace
}  // namespace softarm
