// What is allowed but probably not meant.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/config/load.hpp"
#include "softarm/control/gain_check.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/control/task_space_path.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {
namespace {

/// Can the chambers hold the poses of the reference, at rest, against stiffness and gravity?
class StaticReach {
 public:
  explicit StaticReach(const Experiment& experiment)
      : arm_(experiment.arm),
        workspace_(experiment.arm),
        allocator_(experiment.actuation),
        zero_(Eigen::VectorXd::Zero(experiment.arm.dof())) {}

  /// The smallest part s of the torque that a segment's chambers give in this pose (2n, rad).
  double scale(const std::vector<double>& u_rad) {
    const Eigen::VectorXd u = Eigen::Map<const Eigen::VectorXd>(u_rad.data(), arm_.dof());
    Eigen::VectorXd force(arm_.dof());
    const DynamicsTerms gravity_only = {.inertia = false, .coriolis = false, .gravity = true};
    inverse_dynamics(arm_, workspace_, u, zero_, zero_, zero_, gravity_only, force);
    for (int i = 0; i < arm_.size(); ++i) {
      const double k = arm_.segments[static_cast<std::size_t>(i)].stiffness_nm_per_rad;
      force.segment<2>(2 * i) += k * u.segment<2>(2 * i);
    }
    Eigen::VectorXd tau(arm_.dof());
    solve_actuation(arm_, u, force, tau);
    Allocation allocation;
    allocator_.allocate(tau, allocation);
    return allocation.scale.minCoeff();
  }

  double scale(const ReferenceKind& kind) {
    double smallest = 1.0;
    if (const auto* hold = std::get_if<SetPointReference>(&kind)) smallest = scale(hold->u_rad);
    if (const auto* way = std::get_if<WayPointReference>(&kind)) {
      for (const WayPoint& point : way->points) smallest = std::min(smallest, scale(point.u_rad));
    }
    if (const auto* paper = std::get_if<PaperReference>(&kind)) smallest = scale(*paper);
    return smallest;
  }

 private:
  double scale(const PaperReference& paper) {
    constexpr int kInstants = 36;
    constexpr double kTwoPi = 6.283185307179586;
    double smallest = 1.0;
    for (int k = 0; k < kInstants; ++k) {
      std::vector<double> u;
      for (int i = 0; i < arm_.size(); ++i) {
        const double phi =
            paper.phi_centre_rad +
            paper.phi_amplitude_rad * std::cos(kTwoPi * k / kInstants + i * paper.phase_step_rad);
        u.push_back(paper.theta_rad * std::cos(phi));
        u.push_back(paper.theta_rad * std::sin(phi));
      }
      smallest = std::min(smallest, scale(u));
    }
    return smallest;
  }

  const ArmParameters& arm_;
  DynamicsWorkspace workspace_;
  PressureAllocator allocator_;
  Eigen::VectorXd zero_;
};

/// What the configuration declares of the loop, whoever closes it.
LoopSampling sampling_of(const Experiment& experiment) {
  const SafetySettings& safety = experiment.safety;
  return {.control_period_s = 1.0 / experiment.rate_hz,
          .frame_period_s = safety.frame_period_s,
          .frame_latency_s = safety.frame_latency_s,
          .filter_bandwidth_radps = experiment.estimation.filter_bandwidth_radps,
          .dead_time_s = experiment.control.delay_s,
          .valve_lag_s = experiment.control.valve_lag_s};
}

}  // namespace

std::vector<std::string> experiment_warnings(const Experiment& experiment) {
  auto warnings = gain_warnings(experiment.arm, experiment.control, sampling_of(experiment),
                                largest_theta_rad(experiment.reference));

  StaticReach reach(experiment);
  for (std::size_t i = 0; i < experiment.reference.phases.size(); ++i) {
    const double scale = reach.scale(experiment.reference.phases[i].kind);
    if (scale < 1.0) {
      warnings.push_back(fmt::format(
          "reference[{}]: the chambers give only {:.0f} % of the torque that holds its poses", i,
          std::floor(100.0 * scale)));
    }
  }

  double length_m = 0.0;
  for (const SegmentParameters& segment : experiment.arm.segments) length_m += segment.length_m;
  for (std::size_t i = 0; i < experiment.reference.phases.size(); ++i) {
    const auto* path = std::get_if<TipPathReference>(&experiment.reference.phases[i].kind);
    if (path == nullptr) continue;
    const double away_m = largest_distance_m(*path, experiment.arm.base_position_m);
    if (away_m > length_m) {
      warnings.push_back(fmt::format(
          "reference[{}]: the path goes {:.4g} m away from the base, the arm is {:.4g} m "
          "long: the tip will stay behind",
          i, away_m, length_m));
    }
  }

  const SafetyThresholds thresholds =
      resolve_thresholds(experiment.safety, 1.0 / experiment.rate_hz);
  const MocapSettings& mocap = experiment.plant.mocap;
  const double oldest_s = mocap.latency_s + 1.0 / mocap.rate_hz;
  const double hold_s = 1e-9 * static_cast<double>(thresholds.hold_after_ns);
  if (oldest_s > hold_s) {
    warnings.push_back(fmt::format(
        "plant.mocap: its frames get {:.3g} s old, daemon.safety holds after {:.3g} s: the "
        "simulated arm will never stay ACTIVE",
        oldest_s, hold_s));
  }
  return warnings;
}

}  // namespace softarm
