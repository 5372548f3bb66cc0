#include "softarm/commissioning/loop_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "softarm/simulation/lock_step.hpp"
#include "softarm/simulation/plant_error.hpp"

namespace softarm {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The blow, and the windows in which the disturbance is compared.
constexpr double kAfterJoining_s = 1.0, kBlow_s = 0.01, kBlowPart = 0.02;
constexpr double kEarly_s = 0.3, kLate_s = 4.3, kWindow_s = 0.5;
constexpr std::size_t kPhases = 6;  ///< at most, of the reference

/// Nothing but the loop decides how long the arm is ACTIVE.
Experiment undisturbed(Experiment e) {
  SafetySettings& safety = e.safety;
  safety.arming = Arming::automatic;
  safety.deadman = safety.valve_readback = false;
  safety.curvature_residual_nm = safety.oscillation_rad = safety.length_fault = 0.0;
  return e;
}

double blow_at_s(const Experiment& e) {
  const double active_s = e.safety.good_frames / e.plant.mocap.rate_hz + e.plant.mocap.latency_s;
  return active_s + e.control.blend_s + kAfterJoining_s;
}

/// A force that bends the softest segment by kBlowPart rad or so if it lasted.
ExternalLoad blow(const Experiment& e) {
  double stiffness_nm = kInfinity;
  for (const SegmentParameters& segment : e.plant.arm.segments)
    stiffness_nm = std::min(stiffness_nm, segment.stiffness_nm_per_rad);
  const double size_n = kBlowPart * std::max(stiffness_nm, 1e-3) / e.plant.arm.length_m();
  ExternalLoad load;
  load.force_n = Eigen::Vector3d(size_n, 0.5 * size_n, 0.0);
  load.shape = LoadShape::half_sine;
  load.start_s = blow_at_s(e);
  load.duration_s = kBlow_s;
  return load;
}

/// Spread about its mean of the difference of two motions, over a window.
class Spread {
 public:
  void add(const SegmentVector& difference) {
    if (sum_.size() == 0) sum_.setZero(difference.size());
    sum_ += difference;
    squares_ += difference.squaredNorm();
    ++count_;
  }
  double value() const {
    const double n = static_cast<double>(count_);
    return std::sqrt(std::max(squares_ / n - (sum_ / n).squaredNorm(), 0.0));
  }

 private:
  SegmentVector sum_;
  double squares_ = 0.0;
  int count_ = 0;
};

/// One way in which an arm differs, at the edge of what is uncertain: -1, 0 or 1 times the
/// declared relative deviation.
struct Corner {
  const char* name;
  int gain, stiffness, damping, mass, length;
  bool payload;
};
constexpr Corner kCorners[] = {{"as configured", 0, 0, 0, 0, 0, false},
                               {"with the payload", 0, 0, 0, 0, 0, true},
                               {"soft, light and strong", 1, -1, -1, -1, -1, false},
                               {"soft, heavy and strong, with the payload", 1, -1, -1, 1, 1, true},
                               {"stiff, light and weak", -1, 1, -1, -1, 1, false}};

void scale_gain(Experiment& e, double factor) {
  for (auto& chambers : e.plant.actuation.segments)
    for (Chamber& chamber : chambers) chamber.gain_nm_per_bar *= factor;
}

Experiment at(const Corner& corner, Experiment e) {
  const double part = e.uncertainty.parameters;
  for (SegmentParameters& segment : e.plant.arm.segments) {
    segment.stiffness_nm_per_rad *= 1.0 + corner.stiffness * part;
    segment.damping_nms_per_rad *= 1.0 + corner.damping * part;
    segment.axial_stiffness_n_per_m *= 1.0 + corner.stiffness * part;
    segment.axial_damping_ns_per_m *= 1.0 + corner.damping * part;
    segment.mass_kg *= 1.0 + corner.mass * part;
    segment.length_m *= 1.0 + corner.length * part;
  }
  scale_gain(e, 1.0 + corner.gain * part);
  if (corner.payload) e.plant.payload_kg.back() = e.uncertainty.payload_kg;
  return e;
}

struct Place {
  std::string name;
  ReferenceSettings reference;
};

std::vector<Place> places(const Experiment& e) {
  const std::vector<double> straight(static_cast<std::size_t>(2 * e.arm.size()), 0.0);
  std::vector<Place> out;
  // Polar gains K_P / theta^2 have no meaning at theta = 0, which (24) only passes.
  if (e.control.coordinates == ControlCoordinates::u)
    out.push_back({"straight", {{{SetPointReference{straight}, 0.0}}}});
  const auto& phases = e.reference.phases;
  for (std::size_t i = 0; i < std::min(phases.size(), kPhases); ++i) {
    if (phases[i].kind.get_if<LiveReference>() != nullptr) continue;
    out.push_back({fmt::format("reference[{}]", i), {{{phases[i].kind, 0.0}}}});
  }
  return out;
}

/// The largest value up to `most` that leaves the loop stable, by bisection; `none` is known to.
double largest_stable(double none, double most, double exactness,
                      const std::function<bool(double)>& stable) {
  if (stable(most)) return most;
  while (most - none > exactness) {
    const double middle = 0.5 * (none + most);
    (stable(middle) ? none : most) = middle;
  }
  return none;
}

/// Whether the loop is stable with so many times the moments and so much more dead time.
bool is_stable(Experiment experiment, double gain, double delay_s) {
  scale_gain(experiment, gain);
  experiment.plant.valves.dead_time_s += delay_s;
  return disturbance_growth_1ps(experiment) < 0.0;
}

LoopMargins margins_of(const Experiment& experiment, const LoopFinding& found) {
  LoopMargins margins;
  margins.at = found;
  if (!(found.growth_1ps < 0.0)) return margins;
  margins.gain = largest_stable(1.0, kLargestGainMargin, 0.05,
                                [&](double gain) { return is_stable(experiment, gain, 0.0); });
  margins.delay_s = largest_stable(0.0, kLargestDelayMargin_s, 1e-3, [&](double delay_s) {
    return is_stable(experiment, 1.0, delay_s);
  });
  return margins;
}

/// The smallest margins, each for itself, and where the gain's was found.
void keep_smallest(const LoopMargins& found, LoopMargins& kept) {
  if (kept.at.arm.empty()) {
    kept = found;
    return;
  }
  if (found.gain < kept.gain) {
    kept.gain = found.gain;
    kept.at = found.at;
  }
  kept.delay_s = std::min(kept.delay_s, found.delay_s);
}

/// Of all chambers. @param left_out_s for lags that are not configured
FillVentLag mean_lag(const ActuatorInverseSettings& inverse, int chambers, double left_out_s) {
  FillVentLag sum;
  for (int j = 0; j < chambers; ++j) {
    const FillVentLag lag = inverse.lag(static_cast<std::size_t>(j), left_out_s);
    sum.fill_s += lag.fill_s;
    sum.vent_s += lag.vent_s;
  }
  return {sum.fill_s / chambers, sum.vent_s / chambers};
}

}  // namespace

Experiment on_declared_arm(Experiment e) {
  PlantSettings plant;
  plant.arm = e.arm;
  plant.actuation = e.actuation;
  plant.valves.lag_s = e.control.valve_lag_s;
  plant.valves.dead_time_s = e.control.dead_time_s;
  const ActuatorInverseSettings& inverse = e.actuator_inverse;
  if (inverse.lags()) {
    const FillVentLag lag = mean_lag(inverse, chamber_count(e.actuation), e.control.valve_lag_s);
    plant.valves.lag_s = lag.fill_s;
    plant.valves.vent_lag_s = lag.vent_s;
  }
  plant.material.hysteresis = inverse.hysteresis;
  plant.material.play_bar = inverse.play_bar;
  plant.material.stiffening_per_bar = inverse.stiffening_per_bar;
  plant.valves.supply_pressure_bar = e.actuation.max_pressure_bar;
  plant.mocap.rate_hz = 1.0 / e.safety.frame_period_s;
  plant.mocap.latency_s = e.safety.frame_latency_s;
  // The observer tunes itself by what it sees.
  plant.mocap.position_noise_m = e.estimation.position_noise_m;
  plant.mocap.orientation_noise_rad = e.estimation.orientation_noise_rad;
  plant.initial_u_rad = SegmentVector::Zero(2 * e.arm.size());
  plant.payload_kg.assign(e.arm.segments.size(), 0.0);
  e.plant = plant;
  return e;
}

double disturbance_growth_1ps(const Experiment& asked) {
  const Experiment calm = undisturbed(asked);
  Experiment hit = calm;
  hit.plant.loads.push_back(blow(calm));
  const double blow_s = blow_at_s(calm);
  Spread early, late;
  try {
    LockStep calm_steps(calm, calm.plant), hit_steps(hit, hit.plant);
    LogRow calm_row, hit_row;
    bool was_active = false;
    const double end_s = blow_s + kLate_s + kWindow_s;
    const auto ticks = std::llround(end_s * calm.rate_hz);
    for (std::int64_t k = 0; k < ticks; ++k) {
      const double since_s = static_cast<double>(k) / calm.rate_hz - blow_s;
      const bool judged =
          (since_s >= kEarly_s && since_s < kEarly_s + kWindow_s) || since_s >= kLate_s;
      calm_steps.step(calm_row, judged);
      hit_steps.step(hit_row, judged);
      const bool active = calm_steps.pipeline().output().mode == Mode::active &&
                          hit_steps.pipeline().output().mode == Mode::active;
      if (was_active && !active) return kInfinity;
      was_active = active;
      if (judged) (since_s < kLate_s ? early : late).add(hit_row.truth - calm_row.truth);
    }
    if (!was_active) return kInfinity;
  } catch (const PlantError&) {
    return kInfinity;
  }
  // Where the arm does not move at all nothing grows.
  if (!(early.value() > 0.0)) return -kInfinity;
  return std::log(late.value() / early.value()) / (kLate_s - kEarly_s);
}

LoopCheck check_loop(const Experiment& asked, LoopDepth depth) {
  LoopCheck check;
  if (asked.control.law.get_if<ExternalLaw>() != nullptr) return check;  // it is not here
  const Experiment declared = on_declared_arm(asked);
  for (const Place& place : places(declared)) {
    LoopFinding slowest;
    Experiment configured, worst;
    for (const Corner& corner : kCorners) {
      Experiment experiment = at(corner, declared);
      experiment.reference = place.reference;
      check.findings.push_back({corner.name, place.name, disturbance_growth_1ps(experiment)});
      const LoopFinding& found = check.findings.back();
      if (&corner == kCorners) {
        if (depth == LoopDepth::margins)
          keep_smallest(margins_of(experiment, found), check.configured);
        slowest = found;
        worst = experiment;
      } else if (found.growth_1ps > slowest.growth_1ps) {
        slowest = found;
        worst = std::move(experiment);
      }
    }
    if (depth == LoopDepth::margins) keep_smallest(margins_of(worst, slowest), check.worst);
    if (slowest.growth_1ps < 0.0 && !is_stable(worst, kLeastGainMargin, 0.0))
      check.close.push_back(slowest);
  }
  return check;
}

std::vector<std::string> loop_warnings(const LoopCheck& check) {
  std::vector<std::string> out;
  for (const LoopFinding& finding : check.findings) {
    if (finding.growth_1ps < 0.0) continue;
    out.push_back(
        std::isfinite(finding.growth_1ps)
            ? fmt::format(
                  "the loop is unstable on the arm {}, {}: a disturbance grows by {:.3g} 1/s",
                  finding.arm, finding.where, finding.growth_1ps)
            : fmt::format("the loop does not stay ACTIVE on the arm {}, {}", finding.arm,
                          finding.where));
  }
  for (const LoopFinding& finding : check.close)
    out.push_back(
        fmt::format("the loop is close to unstable on the arm {}, {}: gain margin below {}",
                    finding.arm, finding.where, kLeastGainMargin));
  return out;
}

}  // namespace softarm
