// What the paper's pair of angles a joint costs an integrator, beside crossed joints on the same
// motion.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "softarm/simulation/arm_plant.hpp"
#include "unit/simulation/paper_arm.hpp"

namespace softarm {
namespace {

struct Ride {
  SegmentVector u;
  IntegratorCounters counters;
};

Ride ride(LinkJoints joints, double bend_rad, double relative, double absolute) {
  PlantSettings settings = paper_arm(MassModel::distributed, 4);
  settings.arm.segments.assign(
      4,
      {.length_m = 0.25, .mass_kg = 0.25, .stiffness_nm_per_rad = 2.0, .damping_nms_per_rad = 0.5});
  settings.kind = PlantKind::links;
  settings.links.joints = joints;
  set_torque_actuation(settings.actuation, 4, 100.0);
  settings.valves = {.lag_s = 0.02, .supply_pressure_bar = 100.0};
  settings.initial_u_rad.setZero(8);
  for (int i = 0; i < 4; ++i) settings.initial_u_rad[2 * i] = bend_rad;
  settings.method = IntegratorMethod::sdirk2;
  settings.relative_tolerance = relative;
  settings.absolute_tolerance = absolute;
  ArmPlant plant(settings);
  for (int k = 0; k < 20; ++k) {
    std::vector<double> tau;
    for (int i = 0; i < 4; ++i) {
      tau.push_back(0.6 * std::sin(0.02 * k + i));
      tau.push_back(0.6 * std::cos(0.03 * k));
    }
    plant.advance(0.01 * (k + 1), tau);
  }
  return {plant.u_rad(), plant.counters()};
}

TEST(PolarJoints, ReachTheSameButNearStraightAtAManifoldOfTheCost) {
  for (const double bend_rad : {0.6, 0.01}) {
    const Ride exact = ride(LinkJoints::crossed, bend_rad, 1e-7, 1e-8);
    const Ride crossed = ride(LinkJoints::crossed, bend_rad, 1e-5, 1e-6);
    const Ride polar = ride(LinkJoints::polar, bend_rad, 1e-5, 1e-6);
    EXPECT_LT((crossed.u - exact.u).cwiseAbs().maxCoeff(), 1e-4);
    EXPECT_LT((polar.u - exact.u).cwiseAbs().maxCoeff(), 1e-4);
    if (bend_rad < 0.1) {  // near straight, where the chart is singular
      EXPECT_GT(polar.counters.steps, 3 * crossed.counters.steps);
      EXPECT_GT(polar.counters.linearizations, 50 * crossed.counters.linearizations);
    }
    for (const auto& [name, run] : {std::pair{"crossed", &crossed}, std::pair{"polar", &polar}}) {
      std::printf("[ measured ] bend %.2f rad, %s: %ld steps, %ld residuals, %ld linearizations\n",
                  bend_rad, name, static_cast<long>(run->counters.steps),
                  static_cast<long>(run->counters.residual_evaluations),
                  static_cast<long>(run->counters.linearizations));
    }
  }
}

}  // namespace
}  // namespace softarm
