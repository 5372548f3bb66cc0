// Settings of actuation: the chambers of each segment and the limits of their valves.
// config/template.yaml documents every setting.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "softarm/actuation/fill_vent_lag.hpp"

namespace softarm {

/// A chamber at angle chi about the segment's axis: pressure p adds -gain p (cos chi, sin chi) to
/// the generalized force in u and, where segments stretch, gain p / offset to that on e.
struct Chamber {
  double angle_rad = 0.0;
  double gain_nm_per_bar = 0.839;  ///< effective area times offset
  double offset_m = 0.0125;        ///< of the chamber's centroid from the axis

  bool operator==(const Chamber&) const = default;
};

/// What a command consists of.
enum class ActuationKind {
  chambers,  ///< pressures of chambers, in bar, none below zero
  torque     ///< tau_A itself, two signed moments (N m) about the local x and y axes a segment: for
             ///< simulated arms only. What is named `_bar` then counts N m.
};

/// With `ActuationKind::torque` a segment has two "chambers" of gain 1, the moments about x and y;
/// their angles are not used, and the limits are -max and max.
struct ActuationSettings {
  ActuationKind kind = ActuationKind::chambers;
  std::vector<std::vector<Chamber>>
      segments;  ///< chambers of each segment, in the order of the valves
  double min_pressure_bar = 0.0;
  double max_pressure_bar = 2.0;
  double bias_pressure_bar = 0.0;
  double slew_bar_per_s = 40.0;
  double vent_bar_per_s = 8.0;
  std::optional<double> plane_rad;
};

/// What lies between set points and moments as identification found it, for its inverse in the tick.
/// All zero: no inverse, at no cost.
struct ActuatorInverseSettings {
  /// Of every chamber, where its pressure rises and falls; empty or 0: control.valve_lag_s.
  std::vector<double> fill_lag_s, vent_lag_s;
  double hysteresis = 0.0;                           ///< as ChamberHysteresis: h
  std::vector<double> play_bar = {0.02, 0.05, 0.1};  ///< and its half widths
  /// The weights of these operators are learnt from what the model-based observer leaves over.
  bool learn_hysteresis = false;
  double stiffening_per_bar = 0.0;  ///< k is k (1 + s sum p), p of the segment's chambers
  /// Springs beside K that slip at a bend, as SlipSpring; of every segment. Without stiffness: none.
  std::vector<double> slip_radius_rad = {0.0}, slip_stiffness_nm_per_rad = {0.0};

  /// Of a chamber, counted from 0. @param left_out_s for each of its lags that is not here
  FillVentLag lag(std::size_t chamber, double left_out_s) const {
    const auto of = [&](const std::vector<double>& lag_s) {
      const double own_s = lag_s.empty() ? 0.0 : lag_s.at(chamber);
      return own_s > 0.0 ? own_s : left_out_s;
    };
    return {of(fill_lag_s), of(vent_lag_s)};
  }
  bool lags() const { return positive(fill_lag_s) || positive(vent_lag_s); }
  bool slips() const { return positive(slip_stiffness_nm_per_rad); }
  bool any() const {
    return lags() || hysteresis > 0.0 || learn_hysteresis || stiffening_per_bar > 0.0 || slips();
  }

 private:
  static bool positive(const std::vector<double>& values) {
    return std::any_of(values.begin(), values.end(), [](double value) { return value > 0.0; });
  }
};

/// Number of chambers, or moments, of the whole arm.
inline int chamber_count(const ActuationSettings& settings) {
  std::size_t count = 0;
  for (const auto& chambers : settings.segments) count += chambers.size();
  return static_cast<int>(count);
}

/// More than the chambers of a segment give within the limits: all act along one direction.
struct LargestForce {
  double moment_nm = 0.0;  ///< on u_x, u_y
  double axial_n = 0.0;    ///< on e
};

inline LargestForce largest_force(const ActuationSettings& settings, std::size_t segment) {
  LargestForce per_bar;
  for (const Chamber& chamber : settings.segments[segment]) {
    per_bar.moment_nm += chamber.gain_nm_per_bar;
    per_bar.axial_n += chamber.gain_nm_per_bar / chamber.offset_m;
  }
  const double largest_bar =
      std::max(std::abs(settings.min_pressure_bar), std::abs(settings.max_pressure_bar));
  return {per_bar.moment_nm * largest_bar, per_bar.axial_n * largest_bar};
}

/// Turns settings for `segments` segments into actuation by torque within +-`max_torque_nm`.
inline void set_torque_actuation(ActuationSettings& settings, int segments, double max_torque_nm) {
  settings.kind = ActuationKind::torque;
  settings.segments.assign(static_cast<std::size_t>(segments), std::vector<Chamber>(2, {0.0, 1.0}));
  settings.min_pressure_bar = -max_torque_nm;
  settings.max_pressure_bar = max_torque_nm;
  settings.bias_pressure_bar = 0.0;
  settings.plane_rad.reset();
}

}  // namespace softarm
