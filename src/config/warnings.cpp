// Warnings about settings that are allowed but probably not intended.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include "config/checks.hpp"
#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/base/time.hpp"
#include "softarm/config/load.hpp"
#include "softarm/control/control_laws.hpp"
#include "softarm/control/gain_check.hpp"
#include "softarm/control/reach.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/coordinates.hpp"
#include "softarm/model/statics.hpp"
#include "softarm/runtime/elongation_reference.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/runtime/static_hold.hpp"
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
    double smallest = 1.0;
    for (int k = 0; k < kInstants; ++k) {
      std::vector<double> u;
      for (int i = 0; i < arm_.size(); ++i) {
        const double phi =
            paper.phi_centre_rad +
            paper.phi_amplitude_rad *
                std::cos(2.0 * std::numbers::pi * k / kInstants + i * paper.phase_step_rad);
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

/// A path of the tip at instants that cover it.
struct TipPath {
  std::function<Eigen::Vector3d(int)> at;
  int instants = 0;
  double largest_distance_m = 0.0;  ///< from the base
};

std::optional<TipPath> tip_path(const ReferenceKind& kind, const Eigen::Vector3d& base_m) {
  constexpr int kInstants = 72;
  if (const auto* path = kind.get_if<TipPathReference>()) {
    TipPathReference unit = *path;
    unit.rate_radps = 1.0;
    const int instants = path->shape == TipPathShape::point ? 1 : kInstants;
    return TipPath{
        [=](int k) { return unit.tip(2.0 * std::numbers::pi * k / instants).position_m; }, instants,
        path->largest_distance_m(base_m)};
  }
  const auto* table = kind.get_if<TableReference>();
  if (table == nullptr || !table->is_tip_path()) return {};
  TipPath path{[=](int k) { return table->tip(k * table->duration_s() / kInstants).position_m; },
               kInstants + 1, 0.0};
  for (int k = 0; k < path.instants; ++k)
    path.largest_distance_m = std::max(path.largest_distance_m, (path.at(k) - base_m).norm());
  return path;
}

/// The longest way from the path to where the tip can be, and for how much of it that is too long;
/// and how much of the rest the chambers cannot hold, in the poses that were found.
struct OutOfReach {
  double longest_m = 0.0;
  double part = 0.0;
  double not_held = 0.0;
};

/// Of segments that stretch, with all chambers at the highest pressure; otherwise empty.
SegmentScalars most_elongation_m(const Experiment& experiment) {
  if (!experiment.arm.extensible) return {};
  return straight_elongation(experiment.arm, experiment.actuation,
                             experiment.actuation.max_pressure_bar);
}

OutOfReach out_of_reach(const Experiment& experiment, const TipPath& path) {
  constexpr double kRounding_rad = 1e-6;
  constexpr double kReachTolerance = 0.01;  // of the arm's length
  Eigen::VectorXd u = Eigen::VectorXd::Zero(experiment.arm.dof());
  const SegmentScalars stretch_m = most_elongation_m(experiment);
  std::optional<StaticHold> hold;  // of segments that do not stretch
  if (!experiment.arm.extensible) hold.emplace(experiment.arm, experiment.actuation);
  Eigen::VectorXd bend(experiment.arm.size());
  OutOfReach out;
  for (int k = 0; k < path.instants; ++k) {
    const double away_m =
        distance_out_of_reach_m(experiment.arm, experiment.control.max_theta_rad,
                                experiment.actuation.plane_rad, path.at(k), u, stretch_m);
    out.longest_m = std::max(out.longest_m, away_m);
    if (away_m > kReachTolerance * experiment.arm.length_m()) {
      out.part += 1.0 / path.instants;
      continue;
    }
    if (!hold) continue;
    hold->largest_bend(u, bend);
    for (Eigen::Index i = 0; i < bend.size(); ++i) {
      if (u.segment<2>(2 * i).norm() <= bend[i] + kRounding_rad) continue;
      out.not_held += 1.0 / path.instants;
      break;
    }
  }
  return out;
}

void warn_of_paths(const Experiment& experiment, std::vector<std::string>& warnings) {
  const double arm_m = experiment.arm.length_m() + most_elongation_m(experiment).sum();
  for (std::size_t i = 0; i < experiment.reference.phases.size(); ++i) {
    const auto path = tip_path(experiment.reference.phases[i].kind, experiment.arm.base_position_m);
    if (!path) continue;
    if (path->largest_distance_m > arm_m) {
      warnings.push_back(
          fmt::format("reference[{}]: the path goes {:.4g} m away from the base, the arm is {:.4g} "
                      "m long: the tip will stay behind",
                      i, path->largest_distance_m, arm_m));
      continue;
    }
    const OutOfReach out = out_of_reach(experiment, *path);
    if (out.part > 0.0)
      warnings.push_back(
          fmt::format("reference[{}]: {:.0f} % of the path are out of reach within "
                      "control.max_theta_rad, by up to {:.3g} m: the tip will stay behind",
                      i, std::ceil(100.0 * out.part), out.longest_m));
    if (out.not_held > 0.0)
      warnings.push_back(
          fmt::format("reference[{}]: the chambers cannot hold the arm at rest on {:.0f} % of the "
                      "path, in the poses that a search finds: the tip may stay behind",
                      i, std::ceil(100.0 * out.not_held)));
  }
}

}  // namespace

std::vector<std::string> experiment_warnings(const Experiment& experiment) {
  std::vector<std::string> warnings;
  const auto warn = [&](bool strange, const std::string& text) {
    if (strange) warnings.push_back(text);
  };
  const LawKind& law = experiment.control.law;
  const bool statics = law.get_if<StaticsPiLaw>() != nullptr;
  if (statics || law.get_if<CurvatureLaw>() != nullptr)
    warnings = gain_warnings(experiment.arm,
                             statics ? as_statics_pi(experiment.control) : experiment.control,
                             sampling_of(experiment), largest_theta_rad(experiment.reference));

  const std::string network = network_warning(experiment.transport.lcm.url);
  warn(!network.empty(), network);

  StaticReach reach(experiment);
  for (std::size_t i = 0; i < experiment.reference.phases.size(); ++i) {
    const double scale = reach.scale(experiment.reference.phases[i].kind);
    warn(scale < 1.0,
         fmt::format(
             "reference[{}]: the chambers give only {:.0f} % of the torque that holds its poses", i,
             std::floor(100.0 * scale)));
  }

  const SafetySettings& safety = experiment.safety;
  const double unanswered_s =
      (experiment.valves.tolerated_failures + 1) / experiment.valves.rate_hz;
  warn(safety.valve_readback && unanswered_s >= safety.valve_silence_s,
       fmt::format("valves.tolerated_failures: so many failures last {:.3g} s, "
                   "daemon.safety.valve_silence_s is {:.3g} s: the daemon goes to FAULT before "
                   "softarm-valves has tolerated them",
                   unanswered_s, safety.valve_silence_s));

  const MocapSettings& mocap = experiment.plant.mocap;
  const double oldest_s = mocap.latency_s + 1.0 / mocap.rate_hz;
  const double hold_s =
      to_seconds(resolve_thresholds(safety, 1.0 / experiment.rate_hz).hold_after_ns);
  warn(oldest_s > hold_s,
       fmt::format("plant.mocap: its frames get {:.3g} s old, daemon.safety holds after {:.3g} s: "
                   "the simulated arm will never stay ACTIVE",
                   oldest_s, hold_s));

  warn_of_paths(experiment, warnings);

  const double g = experiment.arm.gravity_mps2.norm();
  warn(g > 0.0 && (g < 1.0 || g > 11.0),
       fmt::format("arm.gravity_mps2: {:.4g} m/s^2 is not that of the earth", g));
  const bool chambers = experiment.actuation.kind == ActuationKind::chambers;
  for (std::size_t i = 0; chambers && i < experiment.arm.segments.size(); ++i) {
    const double bend_rad = full_bend_rad(experiment, i);
    warn(bend_rad > 2.0 * std::numbers::pi || bend_rad < 0.01,
         fmt::format(
             "actuation.chambers: full pressure in one chamber bends segment {} by {:.3g} rad",
             i + 1, bend_rad));
  }
  const double most_bar = experiment.actuation.max_pressure_bar;
  warn(chambers && most_bar > 10.0,
       fmt::format("actuation.max_pressure_bar: {:.4g} bar is much for a soft arm", most_bar));
  const double lag_s = experiment.plant.valves.lag_s;
  warn(lag_s > 1.0, fmt::format("plant.valves.lag_s: {:.4g} s is long for a valve", lag_s));
  warn(drives_real_valves(experiment) && safety.arming == Arming::automatic,
       "daemon.safety.arming: automatic with a terminal that may be real: the arm is pressurised "
       "as soon as frames are good, with nobody asked; explicit is the default there");
  // Slower frames than the thresholds allow are warned of above.
  const double declared = safety.frame_period_s * mocap.rate_hz;
  warn(declared > 1.5,
       fmt::format(
           "plant.mocap.rate_hz: {:.4g} Hz, but daemon.safety.frame_period_s declares {:.4g} Hz{}",
           mocap.rate_hz, 1.0 / safety.frame_period_s,
           declared >= 3.0 ? ": the simulated arm will stay vented" : ""));
  return warnings;
}

}  // namespace softarm
