#include "softarm/commissioning/identification/step_response.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "softarm/base/time.hpp"
#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/simulation/arm_plant.hpp"
#include "softarm/simulation/mocap_simulator.hpp"

namespace softarm {
namespace {

constexpr int kSizes = 3;          ///< of steps by torque
constexpr std::size_t kSides = 4;  ///< of a segment that is moved by torques
constexpr double kRest_s = 0.1;    ///< before the first step

std::vector<std::vector<double>> torque_commands(const Experiment& experiment, double bend_rad) {
  std::vector<std::vector<double>> all;
  for (int size = 1; size <= kSizes; ++size)
    for (std::size_t side = 0; side < kSides; ++side) {
      std::vector<double> command;
      const double phi = 2.0 * std::numbers::pi * static_cast<double>(side) / kSides;
      for (const SegmentParameters& segment : experiment.arm.segments) {
        const double moment_nm = segment.stiffness_nm_per_rad * bend_rad * size / kSizes;
        command.push_back(-moment_nm * std::sin(phi));
        command.push_back(moment_nm * std::cos(phi));
      }
      all.push_back(command);
    }
  return all;
}

/// What is identified to a thousandth must be simulated better than that.
PlantSettings accurate(PlantSettings settings) {
  if (settings.kind.get_if<PccSettings>() == nullptr)
    return settings;  // its difference to the model is larger
  settings.method = IntegratorMethod::cash4;
  settings.relative_tolerance = 1e-6;
  settings.absolute_tolerance = 1e-8;
  settings.max_step_s = 0.0;
  return settings;
}

}  // namespace

std::vector<std::vector<double>> step_commands(const Experiment& experiment, const StepPlan& plan) {
  if (experiment.actuation.kind == ActuationKind::torque)
    return torque_commands(experiment, plan.bend_rad);
  const ActuationSettings& actuation = experiment.actuation;
  std::size_t sides = 0;
  for (const auto& chambers : actuation.segments) sides = std::max(sides, chambers.size());
  std::vector<std::vector<double>> all;
  for (const double step_bar : experiment.identification.steps_bar) {
    const double bar = std::min(step_bar, actuation.max_pressure_bar);
    for (std::size_t side = 0; side < sides; ++side) {
      std::vector<double> command;
      for (const auto& chambers : actuation.segments)
        for (std::size_t j = 0; j < chambers.size(); ++j)
          command.push_back(j == side % chambers.size() ? bar : actuation.min_pressure_bar);
      all.push_back(command);
    }
  }
  return all;
}

MotionRecord record_step_response(const Experiment& experiment, const StepPlan& plan) {
  const int n = experiment.arm.size();
  const MocapSettings& sensing = experiment.plant.mocap;
  ArmPlant plant(accurate(experiment.plant));
  MocapSettings prompt = sensing;
  prompt.latency_s = 0.0;  // frames carry their own time
  MocapSimulator mocap(prompt, n, experiment.plant.seed, 0);
  const CurvatureEstimator estimator(experiment.estimation, experiment.arm,
                                     body_noise(experiment.estimation, n));

  const auto steps = step_commands(experiment, plan);
  const auto per_step = std::max<Eigen::Index>(1, std::lround(plan.hold_s * sensing.rate_hz));
  const auto count = static_cast<Eigen::Index>(steps.size());
  const auto rest = std::max<Eigen::Index>(1, std::lround(kRest_s * sensing.rate_hz));
  const Eigen::Index rows = rest + per_step * count + 1;
  MotionRecord out;
  out.time_s.resize(rows);
  out.u_rad.resize(rows, 2 * n);
  out.input.time_s.setZero(count + 1);
  out.input.value.setZero(count + 1, plant.chambers());
  Eigen::Index seen = 0;
  double variance_rad2 = 0.0;
  std::vector<Eigen::Isometry3d> ends(static_cast<std::size_t>(n));
  MocapFrame frame;
  CurvatureEstimate estimate;
  for (Eigen::Index k = 0; k < rows; ++k) {
    const std::int64_t now_ns = mocap.next_capture_ns();
    const double now_s = to_seconds(now_ns);
    plant.advance(now_s);
    plant.segment_ends(ends);
    mocap.capture(plant.base(), ends);
    if (mocap.receive(now_ns, frame)) {
      estimator.estimate(frame, estimate);
      if (std::all_of(estimate.valid.begin(), estimate.valid.begin() + n,
                      [](bool each) { return each; })) {
        out.time_s[seen] = now_s;
        out.u_rad.row(seen++) = estimate.u_rad;
        for (int i = 0; i < n; ++i)
          variance_rad2 += estimate.variance_rad2[static_cast<std::size_t>(i)];
      }
    }
    const Eigen::Index step = (k - rest) / per_step;
    if (k < rest || (k - rest) % per_step != 0 || step >= count) continue;
    plant.command(steps[static_cast<std::size_t>(step)]);
    out.input.time_s[step + 1] = now_s;
    for (Eigen::Index j = 0; j < plant.chambers(); ++j)
      out.input.value(step + 1, j) =
          steps[static_cast<std::size_t>(step)][static_cast<std::size_t>(j)];
  }
  if (2 * seen < rows)
    throw std::runtime_error("more than half of all frames are lost: see plant.mocap");
  out.noise_rad =
      std::sqrt(variance_rad2 / static_cast<double>(std::max<Eigen::Index>(1, seen * n)));
  out.time_s.conservativeResize(seen);
  out.u_rad.conservativeResize(seen, Eigen::NoChange);
  return out;
}

}  // namespace softarm
