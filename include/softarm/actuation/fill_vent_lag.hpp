// A chamber that fills and vents through its tube: first order, with two time constants.
#pragma once

#include <cmath>

namespace softarm {

/// y' = (x - y) / fill_s where the input x is above y, (x - y) / vent_s where it is below. 0: y
/// follows at once.
struct FillVentLag {
  double fill_s = 0.0;
  double vent_s = 0.0;

  double time_s(double input, double state) const noexcept {
    return input > state ? fill_s : vent_s;
  }
  /// y after `step_s` of an input that is held; exact, since y does not cross x.
  double step(double state, double input, double step_s) const noexcept {
    const double lag_s = time_s(input, state);
    return lag_s > 0.0 ? input + (state - input) * std::exp(-step_s / lag_s) : input;
  }
};

}  // namespace softarm
