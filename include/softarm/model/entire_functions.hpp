// The entire functions c_k(s) that replace every sin(theta)/theta of the paper: no division by
// theta anywhere.
#pragma once

#include <array>

namespace softarm {

/// c_k(s) = sum_j (-s)^j / (k + 2j)! with s = theta^2, so c0 = cos theta, c1 = sin theta / theta,
/// c2 = (1 - cos theta) / theta^2, c3 = (theta - sin theta) / theta^3 and so on;
/// c_k = 1/k! - s c_{k+2} and dc_k/ds = (k c_{k+2} - c_{k+1}) / 2.
inline constexpr int kEntireFunctions = 12;

/// c_0(s) ... c_11(s) for s >= 0, each within a few ulp of max(|c_k|, 1/k!). NaN and infinity give
/// NaN.
std::array<double, kEntireFunctions> entire_functions(double s) noexcept;

}  // namespace softarm
