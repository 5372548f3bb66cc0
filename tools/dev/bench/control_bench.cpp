#include "dev/bench/control_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "dev/bench/interleaved.hpp"
#include "softarm/control/curvature_controller.hpp"
#include "softarm/control/gain_check.hpp"

namespace softarm {
namespace {

constexpr double kRates_hz[] = {50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0};

ControlRow row_of(const std::string& what, const Experiment& experiment) {
  ControlRow row;
  row.what = what;
  row.rate_hz = experiment.rate_hz;
  row.terms = experiment.control.terms;
  return row;
}

/// (17) as configured, without each of its terms, and without all.
std::vector<ControlRow> term_rows(const Experiment& experiment) {
  std::vector<ControlRow> rows;
  const auto add = [&](const char* what, ControlTerms terms) {
    rows.push_back(row_of(what, experiment));
    rows.back().terms = terms;
  };
  add("all of (17)", experiment.control.terms);
  const std::pair<const char*, bool ControlTerms::*> left_out[] = {
      {"without B u''_ref", &ControlTerms::inertia},
      {"without C u'_ref", &ControlTerms::coriolis},
      {"without G", &ControlTerms::gravity},
      {"without K u_ref", &ControlTerms::stiffness},
      {"without D u'_ref", &ControlTerms::damping}};
  for (const auto& [what, term] : left_out) {
    ControlTerms terms = experiment.control.terms;
    terms.*term = false;
    add(what, terms);
  }
  add("K_P and K_D alone", {false, false, false, false, false});
  return rows;
}

/// Processor time of a call of every row's controller, on a bent and moving arm.
void time_controllers(const Experiment& experiment, double seconds, std::vector<ControlRow>& rows) {
  const Eigen::Index dof = experiment.arm.dof();
  const SegmentVector u = Eigen::VectorXd::LinSpaced(dof, 0.2, 0.5);
  ReferenceWindow window;
  for (ReferenceSample* sample : {&window.before, &window.now, &window.after}) {
    sample->u = 1.01 * u;
    sample->velocity = sample->acceleration = u;
  }
  // As in the loop: where a valve lag is inverted the window has a width.
  window.interval_s = experiment.control.valve_lag_s;
  InterleavedTiming timing;
  for (const ControlRow& row : rows) {
    ControllerSettings settings = experiment.control;
    settings.terms = row.terms;
    auto controller = std::make_shared<CurvatureController>(experiment.arm, settings);
    auto out = std::make_shared<ControlOutput>();
    timing.add([=](int calls) {
      for (int k = 0; k < calls; ++k) controller->compute(u, u, window, *out);
    });
  }
  timing.measure(seconds, [](double) {});
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].controller_ns = timing.time(i).median_ns;
}

std::vector<double> spread(double low, double high, int points) {
  std::vector<double> values;
  for (int k = 0; k < points; ++k) values.push_back(low + (high - low) * k / (points - 1));
  return values;
}

Experiment with_gain(Experiment experiment, double kp) {
  std::fill(experiment.control.kp.begin(), experiment.control.kp.end(), kp);
  return experiment;
}

/// K_P at which a blow stops to fade, between gains that are known to be so.
double simulated_limit(const Experiment& experiment, double upper) {
  double low = 0.0, high = upper;
  if (kick(with_gain(experiment, high)).stable) return high;
  while (high - low > 0.02 * high) {
    const double middle = 0.5 * (low + high);
    (kick(with_gain(experiment, middle)).stable ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// What really happens in the simulated loop.
LoopSampling sampling_of_plant(const Experiment& experiment) {
  const MocapSettings& mocap = experiment.plant.mocap;
  return {.control_period_s = 1.0 / experiment.rate_hz,
          .frame_period_s = 1.0 / mocap.rate_hz,
          .frame_latency_s = mocap.latency_s,
          .filter_bandwidth_radps = experiment.estimation.filter_bandwidth_radps,
          .dead_time_s = experiment.plant.valves.dead_time_s,
          .valve_lag_s = experiment.plant.valves.lag_s};
}

}  // namespace

ControlScene bench_scene(const Experiment& experiment, double duration_s, double timing_s,
                         const BenchProgress& progress) {
  ControlScene scene;
  scene.name = experiment.name;
  for (const ReferencePhase& phase : experiment.reference.phases)
    scene.follows_tip |= phase.kind.is_tip_path();
  for (const double rate_hz : kRates_hz) {
    progress(fmt::format("{}: {:g} Hz", scene.name, rate_hz));
    Experiment changed = experiment;
    changed.rate_hz = rate_hz;
    scene.rates.push_back(row_of(fmt::format("{:g} Hz", rate_hz), changed));
    scene.rates.back().trial = track(changed, duration_s);
  }
  scene.terms = term_rows(experiment);
  for (ControlRow& row : scene.terms) {
    progress(fmt::format("{}: {}", scene.name, row.what));
    Experiment changed = experiment;
    changed.control.terms = row.terms;
    row.trial = track(changed, duration_s);
  }
  progress(scene.name + ": timing");
  time_controllers(experiment, timing_s, scene.terms);
  return scene;
}

StabilityMap bench_stability(const Experiment& configured, StabilityAxis axis, int points,
                             const BenchProgress& progress) {
  Experiment experiment = configured;
  std::fill(experiment.control.kd.begin(), experiment.control.kd.end(), 0.0);
  constexpr double kLargestGain = 4.0, kLongestDead_s = 0.03, kLongestLag_s = 0.06;
  const bool dead = axis == StabilityAxis::dead_time;
  StabilityMap map;
  map.axis = dead ? "dead time [s]" : "valve lag [s]";
  map.values = spread(0.0, dead ? kLongestDead_s : kLongestLag_s, points);
  map.kp_nm_per_rad = spread(kLargestGain / points, kLargestGain, points);
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(experiment.arm.dof()), zero = 0.0 * ones;
  for (const double value : map.values) {
    progress(fmt::format("{} {:.4f}", map.axis, value));
    Experiment changed = experiment;
    (dead ? changed.plant.valves.dead_time_s : changed.plant.valves.lag_s) = value;
    changed.control.valve_lag_s = changed.plant.valves.lag_s;
    auto& column = map.simulated.emplace_back();
    for (const double kp : map.kp_nm_per_rad) column.push_back(kick(with_gain(changed, kp)));
    map.simulated_limit.push_back(simulated_limit(changed, 2.0 * kLargestGain));
    map.predicted_limit.push_back(
        std::min(2.0 * kLargestGain,
                 largest_gain_factor(changed.arm, sampling_of_plant(changed), ones, zero, true)));
  }
  return map;
}

std::vector<SoftnessRow> bench_softness(const Experiment& experiment,
                                        const BenchProgress& progress) {
  constexpr double kForce_n = 0.05;
  constexpr double kTracking_s = 10.0;
  const Eigen::Index dof = experiment.arm.dof();
  const Eigen::VectorXd straight = Eigen::VectorXd::Zero(dof);
  const auto held = [&](Experiment changed) {
    changed.reference.phases = {
        {SetPointReference{std::vector<double>(static_cast<std::size_t>(dof), 0.0)}, 0.0}};
    return 1.0 / measured_tip_compliance(changed, kForce_n);
  };
  const auto predicted = [&](double kp, bool gravity) {
    const Eigen::VectorXd gains = Eigen::VectorXd::Constant(dof, kp);
    return 1.0 / tip_compliance(experiment.arm, straight, gains, gravity)(0, 0);
  };
  std::vector<SoftnessRow> rows;
  const auto add = [&](const char* law, double kp, const Experiment& changed, bool tracks) {
    progress(fmt::format("{}, K_P {:g} N m/rad", law, kp));
    SoftnessRow row{law, kp, 0.0, 0.0, std::nan("")};
    row.predicted_n_per_m = predicted(kp, changed.control.terms.gravity);
    row.simulated_n_per_m = held(changed);
    if (tracks) row.tracking_rms_rad = track(changed, kTracking_s).u_rms_rad;
    rows.push_back(row);
  };
  Experiment proportional = experiment;
  proportional.control.terms = {false, false, false, false, false};
  add("passive", 0.0, with_gain(proportional, 0.0), false);
  for (const double kp : {0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 4.0, 8.0, 16.0}) {
    add("(17)", kp, with_gain(experiment, kp), true);
    if (kp > 0.0) add("K_P and K_D alone", kp, with_gain(proportional, kp), true);
  }
  return rows;
}

}  // namespace softarm
