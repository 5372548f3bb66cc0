// The rows of softarm-dev bench robustness against their bounds.
#include <gtest/gtest.h>

#include <filesystem>

#include "dev/bench/robustness_draws.hpp"
#include "dev/bench/robustness_scenes.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

Experiment shipped_experiment(const std::string& name) {
  return load_experiment(std::filesystem::path(SOFTARM_SOURCE_DIR) / "config" / name);
}

void holds(const RobustnessScene& scene, int seeds, bool stretches = false) {
  const Experiment experiment = robustness_experiment(scene, RobustnessLaw::observer_parameters,
                                                      shipped_experiment, stretches);
  for (int seed = 1; seed <= seeds; ++seed) {
    const RobustnessTrial trial = run(experiment, scene, static_cast<std::uint64_t>(seed));
    EXPECT_TRUE(trial.stayed_active) << scene.name << ", seed " << seed;
    EXPECT_LE(1e3 * trial.u_rms_rad, scene.bound_mrad) << scene.name << ", seed " << seed;
  }
}

TEST(Robustness, AFewArmsThatAreNotTheirModel) {
  int found = 0;
  for (const RobustnessScene& scene : robustness_scenes())
    for (const char* const name : {"as configured", "mismatch 20 %", "tilt 20 degrees",
                                   "links plant", "200 ms without frames each second"})
      if (scene.name == name) {
        ++found;
        holds(scene, 1);
      }
  EXPECT_EQ(found, 5);
}

TEST(RobustnessSlow, EveryRowForFiveSeeds) {
  for (const RobustnessScene& scene : robustness_scenes())
    if (scene.bound_mrad > 0.0) holds(scene, 5);
}

TEST(RobustnessSlow, EveryRowOnAnArmThatStretches) {
  for (const RobustnessScene& scene : robustness_scenes())
    if (scene.bound_mrad > 0.0) holds(scene, 1, true);
}

// With 110 to 150 g at the tip and 10 to 20 ms of dead time. Gains that may overshoot in the first
// second, or stiffnesses that may not fall below -0.9, lose one or the other of them.
TEST(RobustnessSlow, HeavyArmsOfTheRandomSearch) {
  const DrawLimits limits;
  for (const std::uint64_t number : {19, 60, 70, 137, 155, 223, 242, 317}) {
    const RobustnessScene scene = drawn_scene(limits, 1, number);
    const Experiment experiment =
        robustness_experiment(scene, RobustnessLaw::observer_parameters, shipped_experiment);
    const RobustnessTrial trial = run(experiment, scene, number);
    EXPECT_TRUE(trial.stayed_active) << number;
    EXPECT_LE(trial.u_rms_rad, limits.good_rad) << number;
  }
}

}  // namespace
}  // namespace softarm
