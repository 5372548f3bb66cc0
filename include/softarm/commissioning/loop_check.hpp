// Is the loop that will run stable, and by how much? Judged before there is an arm.
#pragma once

#include <string>
#include <vector>

#include "softarm/config/experiment.hpp"

namespace softarm {

/// What becomes of a small disturbance of one arm on one reference.
struct LoopFinding {
  std::string arm;    ///< how it differs from what is configured
  std::string where;  ///< "straight", or the phase of the reference
  double growth_1ps;  ///< of the disturbance: negative where the loop is stable; infinite: lost
};

/// How far a loop is from unstable, wherever it was judged: straight and in every phase, each on the
/// arm on which a disturbance fades slowest.
struct LoopMargins {
  LoopFinding at;        ///< where the gain margin is smallest; no arm: margins were not asked for
  double gain = 0.0;     ///< largest factor on the moments of all chambers; 0: unstable as it is
  double delay_s = 0.0;  ///< largest additional dead time
};

/// What the check of a loop found.
struct LoopCheck {
  std::vector<LoopFinding> findings;
  LoopMargins configured;  ///< on the configured arm
  LoopMargins worst;       ///< on all
  /// Stable, but not with kLeastGainMargin times the moments.
  std::vector<LoopFinding> close;
};

/// What is looked for.
enum class LoopDepth {
  stability,  ///< which loops are unstable, or close to it
  margins     ///< by how much they are not, too: some ten times the work
};

inline constexpr double kLeastGainMargin = 1.25;

inline constexpr double kLargestGainMargin = 4.0;      ///< more is not looked for
inline constexpr double kLargestDelayMargin_s = 0.05;  ///< likewise

/// Growth (1/s) of a small disturbance, with everything in the loop that runs: the tick itself
/// (filter or observer, (17), K_I, the tip's loop) in lock step with the arm of experiment.plant.
/// Two runs with the same noise, one with a small blow on the tip; the difference of their u is judged
/// from 0.3 to 4.8 s after the blow. Infinite where the arm does not stay ACTIVE.
double disturbance_growth_1ps(const Experiment& experiment);

/// The experiment with the arm, the valves and the motion capture that it declares for the
/// controller in place of its `plant`, with their noise.
Experiment on_declared_arm(Experiment experiment);

/// Judges the configured arm, and the arms at the edges of arm.uncertainty, held straight and along
/// every phase of the reference (at most six; a live one: straight; polar gains: not straight).
/// Simulates: for three segments less than a second of processor time a place for the stability,
/// some seconds for the margins.
LoopCheck check_loop(const Experiment& experiment, LoopDepth depth = LoopDepth::margins);

/// Texts for a person, none if all is well: unstable, or a gain margin below 1.25.
std::vector<std::string> loop_warnings(const LoopCheck& check);

}  // namespace softarm
