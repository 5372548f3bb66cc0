#include "softarm/commissioning/identification/coverage.hpp"

#include <cmath>
#include <mutex>

#include "commissioning/identification/parallel.hpp"
#include "softarm/commissioning/identification/identify.hpp"
#include "softarm/simulation/random.hpp"

namespace softarm {
namespace {

constexpr std::uint64_t kTruthStream = 7;

void draw_truth(Experiment& experiment, double spread) {
  RandomNumbers random(experiment.seed, kTruthStream);
  const auto factor = [&] { return 1.0 + spread * (2.0 * random.uniform() - 1.0); };
  const double stiffness = factor(), damping = factor();
  experiment.plant.valves.lag_s *= factor();
  for (SegmentParameters& segment : experiment.plant.arm.segments) {
    segment.stiffness_nm_per_rad *= stiffness;
    segment.damping_nms_per_rad *= damping;
  }
  for (auto& chambers : experiment.plant.actuation.segments)
    for (Chamber& chamber : chambers) chamber.gain_nm_per_bar *= factor();
}

/// One seed's errors and half widths, in the set's scales.
struct Trial {
  Eigen::VectorXd truth, error, half_width;
  bool done = false;
};

}  // namespace

CoverageTable study_coverage(const Experiment& experiment, const StepPlan& plan,
                             const FitChoice& choice, const CoverageStudy& study,
                             const std::function<void(int done)>& progress,
                             const std::function<bool()>& stop) {
  const ParameterSet set(configured(experiment), experiment.actuation.kind, choice);
  std::vector<Trial> trials(static_cast<std::size_t>(study.seeds));
  CoverageTable table;
  std::mutex telling;
  in_parallel(study.seeds, study.threads, [&](int k) {
    if (stop && stop()) return;
    Experiment drawn = experiment;
    drawn.seed = drawn.plant.seed = experiment.seed + static_cast<std::uint64_t>(k);
    draw_truth(drawn, study.spread);
    const MotionRecord record = record_step_response(drawn, plan);
    IdentifyOptions options;
    options.window_s = study.window_s;
    const Refinement fit = identify(set, record, options);
    Trial& trial = trials[static_cast<std::size_t>(k)];
    trial.truth = set.of(of_plant(drawn));
    trial.error = fit.x - trial.truth;
    trial.half_width.resize(set.size());
    for (Eigen::Index i = 0; i < set.size(); ++i) trial.half_width[i] = fit.half_width(i);
    trial.done = fit.converged;
    const std::lock_guard lock(telling);
    ++table.seeds;
    if (!fit.converged) ++table.failed;
    if (progress) progress(table.seeds);
  });

  const double count = std::max(1, table.seeds - table.failed);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    CoverageRow row;
    row.name = set[i].name;
    row.unit = set[i].unit;
    double squared = 0.0;
    for (const Trial& trial : trials)
      row.relative = row.relative && (!trial.done || trial.truth[i] != 0.0);
    for (const Trial& trial : trials) {
      if (!trial.done) continue;
      const double scale = row.relative ? 1.0 / std::abs(trial.truth[i]) : set[i].scale;
      const double error = scale * trial.error[i];
      row.covered += std::abs(trial.error[i]) <= trial.half_width[i] ? 1 : 0;
      row.bias += error / count;
      row.half_width += scale * trial.half_width[i] / count;
      row.worst = std::max(row.worst, std::abs(error));
      squared += error * error;
    }
    row.scatter = std::sqrt(std::max(0.0, squared / count - row.bias * row.bias));
    table.rows.push_back(row);
  }
  return table;
}

}  // namespace softarm
