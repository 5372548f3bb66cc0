// softarm-dev bench robustness --draws: arms drawn at random, and what can be known of them before.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "dev/bench/robustness_scenes.hpp"

namespace softarm {

/// How far the arms of a search differ from their file; all numbers are drawn uniformly.
struct DrawLimits {
  double parameters = 0.3;  ///< stiffness, damping, mass and gain of every segment, each on its own
  double payload_kg = 0.15;
  double least_lag_s = 0.01, largest_lag_s = 0.04;
  double dead_time_s = 0.02;  ///< that nobody configured
  double good_rad = 3e-3;     ///< an error up to this is a success
};

/// One arm and its run.
struct Draw {
  std::uint64_t number = 0;
  RobustnessScene scene;
  RobustnessTrial trial;
  /// Of those that did not succeed, and of every tenth of all: the growth of a disturbance on this arm
  /// by the method of softarm check (1/s), negative where that finds the loop stable.
  std::optional<double> growth_1ps;

  bool foreseen_unstable() const { return growth_1ps && !(*growth_1ps < 0.0); }

  bool stable() const { return trial.stayed_active && trial.u_rms_rad < 0.1; }
  bool good(const DrawLimits& limits) const {
    return stable() && trial.u_rms_rad <= limits.good_rad;
  }
};

/// Arm `number` of the search `seed`.
RobustnessScene drawn_scene(const DrawLimits& limits, std::uint64_t seed, std::uint64_t number);

/// Arms `first`, first + 1, ..., each under the observer with parameters.
std::vector<Draw> run_draws(const DrawLimits& limits, std::uint64_t first, int draws,
                            std::uint64_t seed,
                            const std::function<Experiment(const std::string&)>& config,
                            const std::function<void(int)>& progress);

std::string draws_table(const DrawLimits& limits, const std::vector<Draw>& draws);
std::string draws_json(const DrawLimits& limits, const std::vector<Draw>& draws);

}  // namespace softarm
