#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dev/bench/interleaved.hpp"
#include "dev/bench/plant_report.hpp"

namespace softarm {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Trial trial_of(IntegratorMethod method, double tolerance, double absolute = 0.0) {
  return {.label = name(method),
          .method = method,
          .tolerance = tolerance,
          .absolute_tolerance = absolute,
          .max_step_s = 0.0,
          .plain_cvode = false};
}

/// The integrator that a configuration gets by default.
Trial default_trial() {
  const PlantSettings settings;
  return {.label = "default",
          .method = settings.method,
          .tolerance = settings.relative_tolerance,
          .absolute_tolerance = settings.absolute_tolerance,
          .max_step_s = settings.max_step_s,
          .plain_cvode = false};
}

Trial rival(Scene scene) {
  return {.label = scene == Scene::held ? "cvode plain, restarted" : "cvode plain",
          .method = IntegratorMethod::cvode_bdf,
          .tolerance = 1e-6,
          .absolute_tolerance = 0.0,
          .max_step_s = 0.0,
          .plain_cvode = true};
}

/// The rival first. Explicit methods only where the arm is not stiff.
std::vector<Trial> trials_of(const PlantSettings& settings, Scene scene) {
  using enum IntegratorMethod;
  const bool small = settings.kind.get_if<PccSettings>() != nullptr;
  const bool soft =
      small && settings.arm.mass == MassModel::distributed && !settings.arm.extensible;
  std::vector<Trial> trials = {rival(scene), default_trial()};
  const auto add = [&](IntegratorMethod method, std::initializer_list<double> tolerances) {
    for (const double tolerance : tolerances) trials.push_back(trial_of(method, tolerance));
  };
  if (scene == Scene::held) {
    // Wide tolerances: one step a millisecond. What error it then has is that of the step.
    for (const auto method : {cash4, sdirk4}) {
      trials.push_back(trial_of(method, 1e-3, 1e-4));
    }
    add(sdirk2, {1e-4});
    if (small) add(cvode_bdf, {1e-6});
    if (soft) add(erk, {1e-5});
    return trials;
  }
  add(cvode_bdf, {1e-4, 1e-5, 1e-6, 1e-7, 1e-8});
  add(sdirk2, {1e-3, 1e-4, 1e-5});
  add(cash4, {1e-4, 1e-5, 1e-6});
  add(sdirk4, {1e-4, 1e-5, 1e-6});
  if (soft) add(erk, {1e-4, 1e-6});
  return trials;
}

void measure(const BenchPlant& plant, Scene scene, double duration_s, int rounds,
             std::vector<TrialReport>& reports) {
  const std::vector<Trial> trials = trials_of(plant.settings, scene);
  const bool small = plant.settings.kind.get_if<PccSettings>() != nullptr;
  const double tight = scene == Scene::held ? (small ? 1e-9 : 1e-7) : (small ? 1e-10 : 1e-8);
  const PlantRun reference =
      run_plant(plant.settings, scene, trial_of(IntegratorMethod::cash4, tight), duration_s);
  std::vector<std::vector<double>> seconds(trials.size());
  const std::size_t first = reports.size();
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t k = 0; k < trials.size(); ++k) {
      if (round > 0 && seconds[k].front() > 1.0) {  // the slow ones once
        seconds[k].push_back(kNan);
        continue;
      }
      const PlantRun run = run_plant(plant.settings, scene, trials[k], duration_s);
      seconds[k].push_back(run.failure.empty() ? run.seconds : kNan);
      if (round > 0) continue;
      reports.push_back({.plant = plant.name,
                         .scene = scene,
                         .trial = trials[k],
                         .error_rad = largest_difference(run, reference),
                         .factor = kNan,
                         .rival_ratio = kNan,
                         .counters = run.counters,
                         .failure = run.failure});
    }
  }
  for (std::size_t k = 0; k < trials.size(); ++k) {
    std::vector<double> ratios;
    for (std::size_t round = 0; round < seconds[k].size(); ++round) {
      ratios.push_back(seconds[0][round] / seconds[k][round]);
    }
    reports[first + k].factor = duration_s / quantile(seconds[k], 0.5);
    reports[first + k].rival_ratio = quantile(ratios, 0.5);
  }
}

/// Tips (3) and u (2n) of all samples, one below the other.
struct Shapes {
  std::vector<Eigen::Vector3d> tips;
  std::vector<Eigen::VectorXd> u;
  double seconds = 0.0;
};

Shapes shapes_of(int pieces, double duration_s) {
  const PlantSettings settings =
      bench_arm(RefinedSettings{.pieces = pieces}, MassModel::distributed);
  const PlantRun run =
      run_plant(settings, Scene::smooth, trial_of(IntegratorMethod::cvode_bdf, 1e-7), duration_s);
  const auto system = settings.kind.make(settings);
  std::vector<Eigen::Isometry3d> ends(settings.arm.segments.size());
  Shapes shapes{.tips = {}, .u = {}, .seconds = run.seconds};
  for (const Eigen::VectorXd& x : run.samples) {
    Eigen::VectorXd u(settings.arm.dof()), rate(settings.arm.dof());
    system->segment_ends(x, ends);
    system->curvature(x, Eigen::VectorXd::Zero(x.size()), u, rate);
    shapes.tips.push_back(ends.back().translation());
    shapes.u.push_back(u);
  }
  return shapes;
}

}  // namespace

PlantReport bench_plant(double duration_s, int rounds,
                        const std::function<void(const std::string&)>& progress) {
  PlantReport report{.build = bench_build(),
                     .duration_s = duration_s,
                     .rounds = rounds,
                     .trials = {},
                     .pieces = {}};
  for (const BenchPlant& plant : bench_plants()) {
    const bool small = plant.settings.kind.get_if<PccSettings>() != nullptr;
    for (const Scene scene : {Scene::free, Scene::smooth, Scene::held}) {
      progress(fmt::format("{}, {}", plant.name, name(scene)));
      const double length_s = small ? duration_s : 0.5 * duration_s;
      measure(plant, scene, scene == Scene::held && !small ? 0.5 * length_s : length_s, rounds,
              report.trials);
    }
  }
  progress("pieces of a segment");
  const double length_s = 0.5 * duration_s;
  const Shapes many = shapes_of(kManyPieces, length_s);
  for (const int pieces : {1, 2, 4, 8}) {
    const Shapes few = shapes_of(pieces, length_s);
    PiecesReport one{
        .pieces = pieces, .tip_error_m = 0.0, .error_rad = 0.0, .factor = length_s / few.seconds};
    for (std::size_t k = 0; k < std::min(few.tips.size(), many.tips.size()); ++k) {
      one.tip_error_m = std::max(one.tip_error_m, (few.tips[k] - many.tips[k]).norm());
      one.error_rad = std::max(one.error_rad, (few.u[k] - many.u[k]).lpNorm<Eigen::Infinity>());
    }
    report.pieces.push_back(one);
  }
  return report;
}

}  // namespace softarm
