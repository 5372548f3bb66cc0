// softarm-dev bench robustness: arms that are not their model, and sensors and valves that are not
// ideal.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "softarm/config/experiment.hpp"

namespace softarm {

/// What happens to frames on their way in every second, beyond what PlantSettings knows.
struct FrameFaults {
  double lost_s = 0.0;      ///< no frame arrives, from the second's beginning on
  double occluded_s = 0.0;  ///< the end of segment 2 is not seen, likewise
};

/// One row of the table.
struct RobustnessScene {
  std::string name;
  double bound_mrad = 0.0;  ///< of the observer with parameters; 0: none
  std::function<void(Experiment&)> change;
  FrameFaults faults;
  bool nominal = false;         ///< no lag, exact sensing: paper_arm_nominal.yaml
  double counted_from_s = 1.0;  ///< after ACTIVE
  double counted_s = 20.0;
};

std::vector<RobustnessScene> robustness_scenes();

/// A control law of the comparison, from the experiments that come with softarm.
enum class RobustnessLaw {
  paper17,
  statics_pi,
  integral,
  observer,
  observer_parameters,
  observer_repetition
};
inline constexpr RobustnessLaw kRobustnessLaws[] = {RobustnessLaw::paper17,
                                                    RobustnessLaw::statics_pi,
                                                    RobustnessLaw::integral,
                                                    RobustnessLaw::observer,
                                                    RobustnessLaw::observer_parameters,
                                                    RobustnessLaw::observer_repetition};
const char* name(RobustnessLaw law);

/// `config(name)` loads an experiment that comes with softarm.
/// @param stretches the segments, as those of paper_arm_stretching.yaml
Experiment robustness_experiment(const RobustnessScene& scene, RobustnessLaw law,
                                 const std::function<Experiment(const std::string&)>& config,
                                 bool stretches = false);

/// How a run went. Errors are reference minus the arm's true u, a component; NaN where the arm was
/// not ACTIVE.
struct RobustnessTrial {
  double u_rms_rad = 0.0, u_largest_rad = 0.0;
  double tip_rms_m = 0.0;                ///< from where the tip would be at u_ref on a PCC arm
  double e_rms_m = 0.0;                  ///< of all segments; zero where they do not stretch
  double pressure_rate_bar_per_s = 0.0;  ///< RMS of all commanded pressures
  /// Wall clock of a tick: its median, and 90 % of all, which is one with a frame.
  double tick_us = 0.0, frame_tick_us = 0.0;
  double nis = 0.0;        ///< mean, of an observer
  double surprised = 0.0;  ///< part of the frames
  bool stayed_active = true;
};
/// Its figures, by their names; the larger the worse.
inline constexpr std::pair<const char*, double RobustnessTrial::*> kRobustnessFigures[] = {
    {"u_rms_rad", &RobustnessTrial::u_rms_rad},
    {"u_largest_rad", &RobustnessTrial::u_largest_rad},
    {"tip_rms_m", &RobustnessTrial::tip_rms_m},
    {"e_rms_m", &RobustnessTrial::e_rms_m},
    {"pressure_rate_bar_per_s", &RobustnessTrial::pressure_rate_bar_per_s},
    {"tick_us", &RobustnessTrial::tick_us},
    {"frame_tick_us", &RobustnessTrial::frame_tick_us},
    {"nis", &RobustnessTrial::nis},
    {"surprised", &RobustnessTrial::surprised}};
RobustnessTrial run(const Experiment& experiment, const RobustnessScene& scene, std::uint64_t seed);

/// The same over LCM, in real time: softarmd and softarm-plant beside this program, on a port that its
/// process number chooses; where frames are to be lost, a relay in this program loses them. Pressures
/// and times of the tick are not measured (NaN).
/// @throws TransportError; std::runtime_error where the arm was never ACTIVE
RobustnessTrial run_processes(const Experiment& experiment, const RobustnessScene& scene,
                              std::uint64_t seed);

/// A scene under one law, the worst over the seeds of every figure.
struct RobustnessCell {
  RobustnessLaw law;
  RobustnessTrial worst;
};
struct RobustnessRow {
  std::string scene;
  double bound_mrad = 0.0;
  std::vector<RobustnessCell> cells;
};

/// Processor time of the observer, median, with frames at 200 Hz that are 5 ms late, 500 Hz ticks.
struct ObserverCost {
  int segments;
  double tick_us;   ///< a prediction under one more command
  double frame_us;  ///< a frame, and the prediction from there
};
std::vector<ObserverCost> observer_costs();

std::string table(const std::vector<RobustnessRow>& rows, const std::vector<ObserverCost>& costs);
std::string json(const std::vector<RobustnessRow>& rows, const std::vector<ObserverCost>& costs);

}  // namespace softarm
