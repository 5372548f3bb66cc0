// softarm-dev bench control, stability, softness: what is measured, and how it is reported.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "dev/bench/control_trials.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

using BenchProgress = std::function<void(const std::string&)>;

/// One row of a scene: a control rate, or a term of (17) left out.
struct ControlRow {
  std::string what;
  double rate_hz = 0.0;
  ControlTerms terms;
  TrackingTrial trial;
  double controller_ns = 0.0;  ///< processor time of a call of the controller; 0: not measured
};

/// One experiment against control rate and against the terms of (17).
struct ControlScene {
  std::string name;
  bool follows_tip = false;  ///< the error is the tip's
  std::vector<ControlRow> rates, terms;
};

/// @param durations: s of every run
ControlScene bench_scene(const Experiment& experiment, double duration_s, double timing_s,
                         const BenchProgress& progress);
std::string table(const std::vector<ControlScene>& scenes);
std::string json(const std::vector<ControlScene>& scenes);

/// Stability of the straight arm over K_P and one more axis; K_D = 0.
struct StabilityMap {
  std::string axis;  ///< of `values`, with its unit
  std::vector<double> values;
  std::vector<double> kp_nm_per_rad;
  std::vector<std::vector<KickedTrial>> simulated;  ///< [value][kp]
  std::vector<double> predicted_limit;              ///< K_P, linear theory: as `softarm check`
  std::vector<double> simulated_limit;              ///< K_P, by bisection of simulated runs, to 2 %
};

enum class StabilityAxis { dead_time, valve_lag };
/// @param points along each axis
StabilityMap bench_stability(const Experiment& experiment, StabilityAxis axis, int points,
                             const BenchProgress& progress);
std::string table(const std::vector<StabilityMap>& maps);
std::string json(const std::vector<StabilityMap>& maps);

/// Softness of the tip under control, over K_P; the first row is the passive arm.
struct SoftnessRow {
  std::string law;
  double kp_nm_per_rad = 0.0;
  double predicted_n_per_m = 0.0, simulated_n_per_m = 0.0;
  double tracking_rms_rad = 0.0;  ///< of the experiment's own reference; NaN for the passive arm
};
std::vector<SoftnessRow> bench_softness(const Experiment& experiment,
                                        const BenchProgress& progress);
std::string table(const std::vector<SoftnessRow>& rows);
std::string json(const std::vector<SoftnessRow>& rows);

}  // namespace softarm
