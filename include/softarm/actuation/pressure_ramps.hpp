// Limits of commanded pressures and of their rate.
#pragma once

#include "softarm/actuation/pressure_allocator.hpp"

namespace softarm {

/// Moves from `previous` towards `wanted` by at most `max_step` >= 0. Returns `previous` if
/// `wanted` is not finite or `max_step` is not positive.
double step_towards(double previous, double wanted, double max_step) noexcept;

/// Moves from `previous` towards `wanted`: away from zero by at most `max_rise` >= 0, towards zero
/// at once. Returns zero if `wanted` is not finite.
double rise_towards(double previous, double wanted, double max_rise) noexcept;

/// The last stage before the valves: pressure limits, slew limit, vent ramp. Holds no state.
class PressureRamps {
 public:
  /// Takes the limits (bar) and rates (bar/s) of the settings.
  explicit PressureRamps(const ActuationSettings& settings);

  /// Clamps `wanted_bar` into [min, max], then moves from `previous_bar` towards it by at most slew
  /// rate times `dt_s`. `out` may be either argument.
  void limit(const PressureVector& previous_bar, const PressureVector& wanted_bar, double dt_s,
             PressureVector& out) const noexcept;

  /// Moves every pressure towards 0 bar (not the minimum, not the bias) by at most vent rate times
  /// `dt_s`.
  void vent(const PressureVector& previous_bar, double dt_s, PressureVector& out) const noexcept;

 private:
  double min_bar_, max_bar_, slew_bar_per_s_, vent_bar_per_s_;
};

}  // namespace softarm
