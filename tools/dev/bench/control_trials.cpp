#include "dev/bench/control_trials.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "softarm/simulation/lock_step.hpp"
#include "softarm/simulation/plant_error.hpp"

namespace softarm {
namespace {

class RootMeanSquare {
 public:
  void add(double squared, Eigen::Index count) {
    sum_ += squared;
    count_ += count;
  }
  double value() const {
    return count_ > 0 ? std::sqrt(sum_ / static_cast<double>(count_))
                      : std::numeric_limits<double>::quiet_NaN();
  }

 private:
  double sum_ = 0.0;
  Eigen::Index count_ = 0;
};

void hold_straight(Experiment& experiment) {
  const auto dof = static_cast<std::size_t>(experiment.arm.dof());
  experiment.reference.phases = {{SetPointReference{std::vector<double>(dof, 0.0)}, 0.0}};
  experiment.control.blend_s = 0.1;
  experiment.plant.initial_u_rad = SegmentVector::Zero(experiment.arm.dof());
}

}  // namespace

Experiment without_noise(Experiment experiment) {
  experiment.plant.mocap.position_noise_m = 0.0;
  experiment.plant.mocap.orientation_noise_rad = 0.0;
  return experiment;
}

TrackingTrial track(const Experiment& experiment, double duration_s) {
  LockStep steps(experiment, experiment.plant);
  TrackingTrial trial;
  RootMeanSquare u, tip;
  LogRow row;
  double active_since_s = -1.0;
  const auto ticks = std::llround(duration_s * experiment.rate_hz);
  for (std::int64_t k = 0; k < ticks; ++k) {
    steps.step(row);
    if (row.mode != Mode::active) {
      trial.stayed_active &= active_since_s < 0.0;
      continue;
    }
    if (active_since_s < 0.0) active_since_s = row.t_s;
    if (row.t_s < active_since_s + experiment.run.tracking_from_s) continue;
    u.add((row.reference - row.truth).squaredNorm(), row.truth.size());
    if (row.tip_is_asked) tip.add((*row.tip - *row.tip_reference).squaredNorm(), 1);
  }
  trial.stayed_active &= active_since_s >= 0.0;
  trial.u_rms_rad = u.value();
  trial.tip_rms_m = tip.value();
  return trial;
}

KickedTrial kick(const Experiment& asked) {
  constexpr double kAfterActive_s = 0.2, kBlow_s = 0.01, kBlow_n = 0.02;
  constexpr double kWindow_s = 0.5, kEarly_s = 0.3, kLate_s = 2.3;
  constexpr double kNoLongerSmall_rad = 0.05;
  Experiment experiment = without_noise(asked);
  hold_straight(experiment);
  // Enough good frames for ACTIVE, the first of which arrives late.
  const double active_s = experiment.safety.good_frames / experiment.plant.mocap.rate_hz +
                          experiment.plant.mocap.latency_s;
  const double blow_s = active_s + experiment.control.blend_s + kAfterActive_s;
  ExternalLoad blow;
  blow.force_n = Eigen::Vector3d(kBlow_n, 0.5 * kBlow_n, 0.0);
  blow.shape = LoadShape::half_sine;
  blow.start_s = blow_s;
  blow.duration_s = kBlow_s;
  experiment.plant.loads = {blow};

  LockStep steps(experiment, experiment.plant);
  RootMeanSquare early, late;
  LogRow row;
  bool was_active = false;
  const double end_s = blow_s + kLate_s + kWindow_s;
  for (std::int64_t k = 0; k < std::llround(end_s * experiment.rate_hz); ++k) {
    steps.step(row);
    const bool active = row.mode == Mode::active;
    if (was_active && !active) return {std::numeric_limits<double>::infinity(), false};
    was_active = active;
    const double since_s = row.t_s - blow_s;
    if (since_s >= kEarly_s && since_s < kEarly_s + kWindow_s)
      early.add(row.truth.squaredNorm(), row.truth.size());
    if (since_s >= kLate_s) late.add(row.truth.squaredNorm(), row.truth.size());
  }
  KickedTrial trial;
  trial.growth_1ps = std::log(late.value() / early.value()) / (kLate_s - kEarly_s);
  trial.stable = was_active && trial.growth_1ps < 0.0 && late.value() < kNoLongerSmall_rad;
  return trial;
}

double measured_tip_compliance(const Experiment& asked, double force_n) {
  constexpr double kSettled_s = 4.0, kPushed_s = 8.0, kMean_s = 0.5;
  Experiment experiment = without_noise(asked);
  ExternalLoad push;
  push.force_n = Eigen::Vector3d(force_n, 0.0, 0.0);
  push.start_s = kSettled_s;
  experiment.plant.loads = {push};
  LockStep steps(experiment, experiment.plant);
  LogRow row;
  double before = 0.0, after = 0.0;
  int rows_before = 0, rows_after = 0;
  for (std::int64_t k = 0; k < std::llround(kPushed_s * experiment.rate_hz); ++k) {
    steps.step(row);
    if (row.t_s >= kSettled_s - kMean_s && row.t_s < kSettled_s) {
      before += row.tip->x();
      ++rows_before;
    }
    if (row.t_s >= kPushed_s - kMean_s) {
      after += row.tip->x();
      ++rows_after;
    }
  }
  return (after / rows_after - before / rows_before) / force_n;
}

}  // namespace softarm
