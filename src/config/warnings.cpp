// Warnings about settings that are allowed but probably not intended.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "config/plausibility.hpp"
#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/base/time.hpp"
#include "softarm/config/load.hpp"
#include "softarm/control/control_laws.hpp"
#include "softarm/control/gain_check.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/coordinates.hpp"
#include "softarm/model/statics.hpp"
#include "softarm/runtime/elongation_reference.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/lcm_node.hpp"

namespace softarm {
namespace {

/// Checks whether the chambers can hold the poses of the reference at rest against stiffness and
/// gravity.
class StaticReach {
 public:
  explicit StaticReach(const Experiment& experiment)
      : arm_(experiment.arm),
        workspace_(experiment.arm),
        allocator_(experiment.actuation, experiment.arm.extensible) {
    if (arm_.extensible)
      natural_m_ =
          straight_elongation(arm_, experiment.actuation, experiment.actuation.bias_pressure_bar);
  }

  /// The smallest part s of the torque that a segment's chambers give in this pose (2n, rad).
  double scale(const std::vector<double>& u_rad) {
    const Eigen::VectorXd u = coordinates(
        arm_, Eigen::Map<const Eigen::VectorXd>(u_rad.data(), 2 * arm_.size()), natural_m_);
    Eigen::VectorXd force(arm_.dof());
    static_moments(arm_, workspace_, u, force);
    Eigen::VectorXd tau(arm_.dof());
    solve_actuation(arm_, u, force, tau);
    Allocation allocation;
    allocator_.allocate(tau, allocation);
    return allocation.scale.minCoeff();
  }

  double scale(const ReferenceKind& kind) {
    double smallest = 1.0;
    if (const auto* hold = kind.get_if<SetPointReference>()) smallest = scale(hold->u_rad);
    if (const auto* way = kind.get_if<WayPointReference>()) {
      for (const WayPoint& point : way->points) smallest = std::min(smallest, scale(point.u_rad));
    }
    if (const auto* paper = kind.get_if<PaperReference>()) smallest = scale(*paper);
    if (const auto* table = kind.get_if<TableReference>(); table && !table->is_tip_path())
      smallest = scale(*table);
    return smallest;
  }

 private:
  double scale(const TableReference& table) {
    constexpr int kInstants = 1000;
    ReferenceSample sample;
    for (auto* v : {&sample.u, &sample.velocity, &sample.acceleration}) v->setZero(arm_.dof());
    double smallest = 1.0;
    for (int k = 0; k <= kInstants; ++k) {
      table.evaluate(k * table.duration_s() / kInstants, sample);
      smallest = std::min(smallest, scale({sample.u.begin(), sample.u.end()}));
    }
    return smallest;
  }
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
  SegmentScalars natural_m_;
  DynamicsWorkspace workspace_;
  PressureAllocator allocator_;
};

/// The control loop as the configuration declares it.
LoopSampling sampling_of(const Experiment& experiment) {
  const SafetySettings& safety = experiment.safety;
  return {.control_period_s = 1.0 / experiment.rate_hz,
          .frame_period_s = safety.frame_period_s,
          .frame_latency_s = safety.frame_latency_s,
          .filter_bandwidth_radps = experiment.estimation.filter_bandwidth_radps,
          .dead_time_s = experiment.control.dead_time_s,
          .valve_lag_s = experiment.control.valve_lag_s};
}

}  // namespace

std::vector<std::string> experiment_warnings(const Experiment& experiment) {
  std::vector<std::string> warnings;
  const LawKind& law = experiment.control.law;
  const bool statics = law.get_if<StaticsPiLaw>() != nullptr;
  if (statics || law.get_if<CurvatureLaw>() != nullptr)
    warnings = gain_warnings(experiment.arm,
                             statics ? as_statics_pi(experiment.control) : experiment.control,
                             sampling_of(experiment), largest_theta_rad(experiment.reference));

  if (const std::string other = network_warning(experiment.transport.lcm.url); !other.empty())
    warnings.push_back(other);

  StaticReach reach(experiment);
  for (std::size_t i = 0; i < experiment.reference.phases.size(); ++i) {
    const double scale = reach.scale(experiment.reference.phases[i].kind);
    if (scale < 1.0) {
      warnings.push_back(fmt::format(
          "reference[{}]: the chambers give only {:.0f} % of the torque that holds its poses", i,
          std::floor(100.0 * scale)));
    }
  }

  const SafetyThresholds thresholds =
      resolve_thresholds(experiment.safety, 1.0 / experiment.rate_hz);
  const double unanswered_s =
      (experiment.valves.tolerated_failures + 1) / experiment.valves.rate_hz;
  if (experiment.safety.valve_readback && unanswered_s >= experiment.safety.valve_silence_s) {
    warnings.push_back(fmt::format(
        "valves.tolerated_failures: so many failures last {:.3g} s, daemon.safety.valve_silence_s "
        "is {:.3g} s: the daemon goes to FAULT before softarm-valves has tolerated them",
        unanswered_s, experiment.safety.valve_silence_s));
  }

  const MocapSettings& mocap = experiment.plant.mocap;
  const double oldest_s = mocap.latency_s + 1.0 / mocap.rate_hz;
  const double hold_s = to_seconds(thresholds.hold_after_ns);
  if (oldest_s > hold_s) {
    warnings.push_back(fmt::format(
        "plant.mocap: its frames get {:.3g} s old, daemon.safety holds after {:.3g} s: the "
        "simulated arm will never stay ACTIVE",
        oldest_s, hold_s));
  }
  for (std::string& each : plausibility_warnings(experiment)) warnings.push_back(std::move(each));
  return warnings;
}

}  // namespace softarm
