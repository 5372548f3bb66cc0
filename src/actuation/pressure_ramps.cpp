#include "softarm/actuation/pressure_ramps.hpp"

#include <algorithm>
#include <cmath>

namespace softarm {

double step_towards(double previous, double wanted, double max_step) noexcept {
  if (!std::isfinite(wanted) || !(max_step > 0.0)) return previous;
  const double step = wanted - previous;
  if (std::abs(step) <= max_step) return wanted;
  return previous + std::copysign(max_step, step);
}

double rise_towards(double previous, double wanted, double max_rise) noexcept {
  if (!std::isfinite(wanted)) return 0.0;
  const double from = previous * wanted > 0.0 ? std::abs(previous) : 0.0;
  const double most = from + std::max(max_rise, 0.0);
  return std::abs(wanted) <= most ? wanted : std::copysign(most, wanted);
}

PressureRamps::PressureRamps(const ActuationSettings& settings)
    : min_bar_(settings.min_pressure_bar),
      max_bar_(settings.max_pressure_bar),
      slew_bar_per_s_(settings.slew_bar_per_s),
      vent_bar_per_s_(settings.vent_bar_per_s) {}

void PressureRamps::limit(const PressureVector& previous_bar, const PressureVector& wanted_bar,
                          double dt_s, PressureVector& out) const noexcept {
  const double max_step = slew_bar_per_s_ * dt_s;
  out.resize(previous_bar.size());
  for (Eigen::Index j = 0; j < previous_bar.size(); ++j) {
    // A NaN passes through max and min in this order and is refused by the step.
    const double wanted = std::min(std::max(wanted_bar[j], min_bar_), max_bar_);
    out[j] = step_towards(previous_bar[j], wanted, max_step);
  }
}

void PressureRamps::vent(const PressureVector& previous_bar, double dt_s,
                         PressureVector& out) const noexcept {
  const double max_step = vent_bar_per_s_ * dt_s;
  out.resize(previous_bar.size());
  for (Eigen::Index j = 0; j < previous_bar.size(); ++j) {
    out[j] = step_towards(previous_bar[j], 0.0, max_step);
  }
}

}  // namespace softarm
