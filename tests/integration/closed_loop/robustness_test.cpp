// The rows of softarm-dev bench robustness against their bounds.
#include <gtest/gtest.h>

#include <filesystem>

#include "dev/bench/robustness_scenes.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

Experiment shipped_experiment(const std::string& name) {
  return load_experiment(std::filesystem::path(SOFTARM_SOURCE_DIR) / "config" / name);
}

void holds(const RobustnessScene& scene, int seeds) {
  const Experiment experiment =
      robustness_experiment(scene, RobustnessLaw::observer_parameters, shipped_experiment);
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

}  // namespace
}  // namespace softarm
