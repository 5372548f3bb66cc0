#include "identification/step_response.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/plant/arm_plant.hpp"
#include "softarm/plant/mocap_simulator.hpp"

namespace softarm {
namespace {

constexpr int kSizes = 3;
constexpr std::size_t kSides = 4;  ///< of a segment that is moved by torques

/// The commands of the plan, one after the other.
std::vector<std::vector<double>> commands(const Experiment& experiment, const StepPlan& plan) {
  const bool torque = experiment.actuation.kind == ActuationKind::torque;
  std::size_t sides = kSides;
  if (!torque) {
    sides = 0;
    for (const auto& chambers : experiment.actuation.segments)
      sides = std::max(sides, chambers.size());
  }
  std::vector<std::vector<double>> all;
  for (int size = 1; size <= kSizes; ++size) {
    for (std::size_t side = 0; side < sides; ++side) {
      std::vector<double> command;
      for (std::size_t i = 0; i < experiment.arm.segments.size(); ++i) {
        const double moment_nm =
            experiment.arm.segments[i].stiffness_nm_per_rad * plan.bend_rad * size / kSizes;
        if (torque) {
          const double phi = 2.0 * std::numbers::pi * static_cast<double>(side) / kSides;
          command.push_back(-moment_nm * std::sin(phi));
          command.push_back(moment_nm * std::cos(phi));
          continue;
        }
        const std::vector<Chamber>& chambers = experiment.actuation.segments[i];
        for (std::size_t j = 0; j < chambers.size(); ++j) {
          const double pressure =
              j == side % chambers.size() ? moment_nm / chambers[j].gain_nm_per_bar : 0.0;
          command.push_back(std::min(pressure, experiment.actuation.max_pressure_bar));
        }
      }
      all.push_back(command);
    }
  }
  return all;
}

/// Straight lines over the rows of frames that were lost.
void interpolate(Eigen::MatrixXd& u, const std::vector<bool>& seen) {
  const auto count = std::count(seen.begin(), seen.end(), true);
  if (static_cast<std::size_t>(2 * count) < seen.size())
    throw std::runtime_error("more than half of all frames are lost: see plant.mocap");
  Eigen::Index last = -1;
  for (Eigen::Index k = 0; k < u.rows(); ++k) {
    if (!seen[static_cast<std::size_t>(k)]) continue;
    for (Eigen::Index j = last + 1; j < k; ++j) {
      const double x =
          last < 0 ? 1.0 : static_cast<double>(j - last) / static_cast<double>(k - last);
      u.row(j) = (last < 0 ? u.row(k) : u.row(last)) * (1.0 - x) + x * u.row(k);
    }
    last = k;
  }
  for (Eigen::Index j = last + 1; j < u.rows(); ++j) u.row(j) = u.row(last);
}

}  // namespace

StepResponse record_step_response(const Experiment& experiment, const StepPlan& plan) {
  const int n = experiment.arm.size();
  MocapSettings sensing = experiment.plant.mocap;
  sensing.latency_s = 0.0;  // frames carry their own time
  ArmPlant plant(experiment.plant);
  MocapSimulator mocap(sensing, n, experiment.plant.seed, 0);
  const CurvatureEstimator estimator(
      experiment.estimation, experiment.arm,
      body_noise(experiment.estimation, n, experiment.daemon.bodies.base_id < 0));

  const auto steps = commands(experiment, plan);
  const auto per_step =
      std::max<Eigen::Index>(1, std::lround(plan.hold_s * experiment.plant.mocap.rate_hz));
  const Eigen::Index rows = per_step * static_cast<Eigen::Index>(steps.size()) + 1;
  StepResponse out;
  out.period_s = 1.0 / sensing.rate_hz;
  out.u_rad.setZero(rows, 2 * n);
  out.input.setZero(rows, plant.chambers());
  std::vector<bool> seen(static_cast<std::size_t>(rows), false);
  std::vector<Eigen::Isometry3d> ends(static_cast<std::size_t>(n));
  MocapFrame frame;
  CurvatureEstimate estimate;
  for (Eigen::Index k = 0; k < rows; ++k) {
    const std::int64_t now_ns = mocap.next_capture_ns();
    plant.advance(1e-9 * static_cast<double>(now_ns));
    plant.segment_ends(ends);
    mocap.capture(plant.base(), ends);
    if (mocap.receive(now_ns, frame)) {
      estimator.estimate(frame, estimate);
      seen[static_cast<std::size_t>(k)] = std::all_of(
          estimate.valid.begin(), estimate.valid.begin() + n, [](bool each) { return each; });
      out.u_rad.row(k) = estimate.u_rad;
    }
    // A step falls on an instant: what counts there is the mean of before and after.
    out.input.row(k) = 0.5 * plant.pressures_bar();
    if (k % per_step == 0 && k / per_step < static_cast<Eigen::Index>(steps.size()))
      plant.command(steps[static_cast<std::size_t>(k / per_step)]);
    out.input.row(k) += 0.5 * plant.pressures_bar();
  }
  interpolate(out.u_rad, seen);
  return out;
}

}  // namespace softarm
