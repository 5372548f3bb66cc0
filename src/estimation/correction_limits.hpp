// How far an arm may differ from its model before what is learnt is no correction any more.
#pragma once

#include <algorithm>

namespace softarm {

/// Of relative errors. As the weight is their scale, 150 g on the end of a segment of 100 g with 30 %
/// less gain is one of -0.82.
inline constexpr double kLeastCorrection = -0.9, kLargestCorrection = 2.0;

/// Into [low, high]. Whether it is at one of them: what is pushed against a limit stays near it, not
/// on it.
inline bool limit_correction(double& value, double low = kLeastCorrection,
                             double high = kLargestCorrection) noexcept {
  constexpr double kNear = 0.95;
  const bool inside = value > kNear * low && value < kNear * high;
  value = std::clamp(value, low, high);
  return !inside;
}

}  // namespace softarm
