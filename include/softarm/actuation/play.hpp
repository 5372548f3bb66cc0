// Backlash.
#pragma once

#include <algorithm>

namespace softarm {

/// The play operator: `output` stays where it is until `input` leaves output +- half_width, and
/// then follows at that distance. Along a monotone input its result depends on the last value alone.
/// Weighted sums of it are the Prandtl-Ishlinskii model of hysteresis.
inline double play(double output, double input, double half_width) noexcept {
  return std::clamp(output, input - half_width, input + half_width);
}

}  // namespace softarm
