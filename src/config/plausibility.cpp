#include "config/plausibility.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include "softarm/base/time.hpp"
#include "softarm/control/reach.hpp"
#include "softarm/runtime/elongation_reference.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/runtime/static_hold.hpp"

namespace softarm {
namespace {

/// With real valves, whatever the derived thresholds would be.
constexpr double kLongestHold_s = 0.25;
constexpr double kLongestVentDelay_s = 0.5;
/// Everywhere: a stop vents within this time, with all that comes before and after the ramp.
constexpr double kLongestStop_s = 1.0;
constexpr int kFramesATick = 64;  ///< that the daemon takes
constexpr int kTicksOfAStop = 4;  ///< one until it is noticed, three zero commands at the end
constexpr double kMostGravity_mps2 = 20.0;
constexpr double kMostBend_rad = 20.0;    ///< of one chamber at full pressure against the spring
constexpr double kReachTolerance = 0.01;  ///< of the arm's length

double length_m(const ArmParameters& arm) {
  double sum = 0.0;
  for (const SegmentParameters& segment : arm.segments) sum += segment.length_m;
  return sum;
}

/// Largest bend in rad that one chamber of the segment can hold at full pressure.
double full_bend_rad(const Experiment& experiment, std::size_t segment) {
  double gain = 0.0;
  for (const Chamber& chamber : experiment.actuation.segments[segment])
    gain = std::max(gain, chamber.gain_nm_per_bar);
  return gain * experiment.actuation.max_pressure_bar /
         experiment.arm.segments[segment].stiffness_nm_per_rad;
}

class Plausibility {
 public:
  Plausibility(const Experiment& experiment, const ConfigKeys& keys)
      : experiment_(experiment), keys_(keys) {}

  void run() const {
    check_arm();
    check_marker_frames();
    check_tick();
    if (drives_real_valves(experiment_)) check_times();
  }

 private:
  void require(bool holds, const std::string& key, const std::string& expected,
               const std::string& got) const {
    if (!holds) throw keys_.error_at(key, expected, got);
  }

  void check_arm() const {
    const ArmParameters& arm = experiment_.arm;
    const Eigen::Vector3d& g = arm.gravity_mps2;
    require(g.z() <= 0.0 && g.norm() <= kMostGravity_mps2, "arm.gravity_mps2",
            fmt::format("a vector that does not point up (z of the world is up), at most {} m/s^2",
                        kMostGravity_mps2),
            fmt::format("[{}, {}, {}] m/s^2", g.x(), g.y(), g.z()));
    if (experiment_.actuation.kind == ActuationKind::torque) return;
    for (std::size_t i = 0; i < arm.segments.size(); ++i) {
      const double bend_rad = full_bend_rad(experiment_, i);
      require(
          bend_rad <= kMostBend_rad, "actuation.chambers",
          fmt::format("chambers that bend a segment by at most {} rad at max_pressure_bar (gain "
                      "in N m/bar, stiffness in N m/rad)",
                      kMostBend_rad),
          fmt::format("{:.4g} rad in segment {}", bend_rad, i + 1));
    }
  }

  /// Millimetres taken for metres.
  void check_marker_frames() const {
    const BodySettings& bodies = experiment_.transport.bodies;
    const double most_m = std::max(1.0, length_m(experiment_.arm));
    const auto check = [&](const std::string& key, const MarkerFrameSettings& frame) {
      require(frame.position_m.norm() <= most_m, key + ".position_m",
              fmt::format("a marker frame at most {:.4g} m beside its body", most_m),
              fmt::format("{:.4g} m", frame.position_m.norm()));
    };
    if (bodies.base_id >= 0) check("daemon.bodies.base_plate", bodies.base_marker_frame);
    for (const MarkerFrameSettings& frame : bodies.segment_marker_frames)
      check("daemon.bodies.segment_plates", frame);
  }

  /// A rate at which frames or the ramp cannot do their work.
  void check_tick() const {
    const SafetySettings& safety = experiment_.safety;
    const double tick_s = 1.0 / experiment_.rate_hz;
    const std::string got = fmt::format("{:.6g} Hz", experiment_.rate_hz);
    const double wait_s = safety.max_latency_s - safety.frame_latency_s;
    require(tick_s <= wait_s + 1e-9, "daemon.rate_hz",
            fmt::format("at least {:.6g} Hz: frames wait up to a tick and are then older than "
                        "daemon.safety.max_latency_s, so good_frames in a row never come",
                        wait_s > 0.0 ? 1.0 / wait_s : INFINITY),
            got);
    require(tick_s <= kFramesATick * safety.frame_period_s, "daemon.rate_hz",
            fmt::format("at least {:.6g} Hz: a tick takes {} frames, more of them would be lost",
                        1.0 / (kFramesATick * safety.frame_period_s), kFramesATick),
            got);
    const ActuationSettings& actuation = experiment_.actuation;
    const double ramp_ticks =
        std::ceil(actuation.max_pressure_bar / (actuation.vent_bar_per_s * tick_s) - 1e-9);
    require((ramp_ticks + kTicksOfAStop) * tick_s < kLongestStop_s, "daemon.rate_hz",
            fmt::format("a rate at which a stop takes less than {} s ({:.0f} ticks of the vent "
                        "ramp, {} around it)",
                        kLongestStop_s, ramp_ticks, kTicksOfAStop),
            got);
    require(safety.vent_overruns * tick_s <= kLongestStop_s, "daemon.safety.vent_overruns",
            fmt::format("at most {} s of ticks", kLongestStop_s),
            fmt::format("{:.4g} s", safety.vent_overruns * tick_s));
  }

  void check_times() const {
    const SafetySettings& safety = experiment_.safety;
    const SafetyThresholds resolved = resolve_thresholds(safety, 1.0 / experiment_.rate_hz);
    const auto at_most = [&](const char* key, double value_s, double bound_s) {
      require(value_s <= bound_s, fmt::format("daemon.safety.{}", key),
              fmt::format("a time of at most {} s where real valves are driven, given or derived",
                          bound_s),
              fmt::format("{:.4g} s", value_s));
    };
    at_most("hold_after_s", to_seconds(resolved.hold_after_ns), kLongestHold_s);
    at_most("vent_after_s", to_seconds(resolved.vent_after_ns), kLongestVentDelay_s);
    at_most("deadman_timeout_s", safety.deadman_timeout_s, kLongestVentDelay_s);
    if (safety.valve_readback)
      at_most("valve_silence_s", safety.valve_silence_s, kLongestVentDelay_s);
  }

  const Experiment& experiment_;
  const ConfigKeys& keys_;
};

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
    if (away_m > kReachTolerance * length_m(experiment.arm)) {
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
  const double arm_m = length_m(experiment.arm) + most_elongation_m(experiment).sum();
  for (std::size_t i = 0; i < experiment.reference.phases.size(); ++i) {
    const auto path = tip_path(experiment.reference.phases[i].kind, experiment.arm.base_position_m);
    if (!path) continue;
    if (path->largest_distance_m > arm_m) {
      warnings.push_back(fmt::format(
          "reference[{}]: the path goes {:.4g} m away from the base, the arm is {:.4g} m "
          "long: the tip will stay behind",
          i, path->largest_distance_m, arm_m));
      continue;
    }
    const OutOfReach out = out_of_reach(experiment, *path);
    if (out.part > 0.0)
      warnings.push_back(fmt::format(
          "reference[{}]: {:.0f} % of the path are out of reach within control.max_theta_rad, by "
          "up to {:.3g} m: the tip will stay behind",
          i, std::ceil(100.0 * out.part), out.longest_m));
    if (out.not_held > 0.0)
      warnings.push_back(fmt::format(
          "reference[{}]: the chambers cannot hold the arm at rest on {:.0f} % of the path, in the "
          "poses that a search finds: the tip may stay behind",
          i, std::ceil(100.0 * out.not_held)));
  }
}

}  // namespace

bool drives_real_valves(const Experiment& experiment) {
  const ValveDriverSettings& valves = experiment.valves;
  return experiment.actuation.kind == ActuationKind::chambers &&
         (valves.backend != "modbus" || !valves.host.starts_with("127."));
}

void check_plausibility(const Experiment& experiment, const ConfigKeys& keys) {
  Plausibility(experiment, keys).run();
}

std::vector<std::string> plausibility_warnings(const Experiment& experiment) {
  std::vector<std::string> warnings;
  warn_of_paths(experiment, warnings);
  const auto warn = [&](bool strange, const auto& text) {
    if (strange) warnings.push_back(text());
  };
  const double g = experiment.arm.gravity_mps2.norm();
  warn(g > 0.0 && (g < 1.0 || g > 11.0),
       [&] { return fmt::format("arm.gravity_mps2: {:.4g} m/s^2 is not that of the earth", g); });
  const bool chambers = experiment.actuation.kind == ActuationKind::chambers;
  for (std::size_t i = 0; chambers && i < experiment.arm.segments.size(); ++i) {
    const double bend_rad = full_bend_rad(experiment, i);
    warn(bend_rad > 2.0 * std::numbers::pi || bend_rad < 0.01, [&] {
      return fmt::format(
          "actuation.chambers: full pressure in one chamber bends segment {} by {:.3g} rad", i + 1,
          bend_rad);
    });
  }
  warn(chambers && experiment.actuation.max_pressure_bar > 10.0, [&] {
    return fmt::format("actuation.max_pressure_bar: {:.4g} bar is much for a soft arm",
                       experiment.actuation.max_pressure_bar);
  });
  warn(experiment.plant.valves.lag_s > 1.0, [&] {
    return fmt::format("plant.valves.lag_s: {:.4g} s is long for a valve",
                       experiment.plant.valves.lag_s);
  });
  warn(drives_real_valves(experiment) && experiment.safety.arming == Arming::automatic, [] {
    return fmt::format(
        "daemon.safety.arming: automatic with a terminal that may be real: the arm is pressurised "
        "as soon as frames are good, with nobody asked; explicit is the default there");
  });
  // Slower frames than the thresholds allow are warned of by name (experiment_warnings).
  const double declared = experiment.safety.frame_period_s * experiment.plant.mocap.rate_hz;
  warn(declared > 1.5, [&] {
    return fmt::format(
        "plant.mocap.rate_hz: {:.4g} Hz, but daemon.safety.frame_period_s declares {:.4g} Hz{}",
        experiment.plant.mocap.rate_hz, 1.0 / experiment.safety.frame_period_s,
        declared >= 3.0 ? ": the simulated arm will stay vented" : "");
  });
  return warnings;
}

}  // namespace softarm
