// A soft limit on theta that a reference meets smoothly.
#pragma once

#include <cmath>

#include "softarm/control/reference.hpp"

namespace softarm {

inline constexpr double kKnee = 0.98;  ///< of max_theta_rad: from here on theta is bent

/// Bends u inside of theta < limit: theta -> knee + w tanh((theta - knee) / w), w = limit - knee;
/// C2, exact chain rule.
/// @param width coordinates of a segment: 2, or 3 where segments stretch
inline bool bend_inside(double limit, Eigen::Index width, ReferenceSample& sample) noexcept {
  const double knee = kKnee * limit, w = limit - knee;
  bool bent = false;
  for (Eigen::Index i = 0; i < sample.u.size(); i += width) {
    auto u = sample.u.segment<2>(i), ud = sample.velocity.segment<2>(i),
         udd = sample.acceleration.segment<2>(i);
    const double r = u.norm();
    if (r <= knee) continue;
    bent = true;
    const Eigen::Vector2d n = u / r;
    const double rd = n.dot(ud), rdd = (ud.squaredNorm() + u.dot(udd) - rd * rd) / r;
    const Eigen::Vector2d nd = (ud - rd * n) / r, ndd = (udd - rdd * n - 2.0 * rd * nd) / r;
    const double s = std::tanh((r - knee) / w), slope = 1.0 - s * s;
    const double bent_r = knee + w * s, bent_rd = slope * rd;
    const double bent_rdd = slope * rdd - 2.0 * s * slope / w * rd * rd;
    u = bent_r * n;
    ud = bent_rd * n + bent_r * nd;
    udd = bent_rdd * n + 2.0 * bent_rd * nd + bent_r * ndd;
  }
  return bent;
}

}  // namespace softarm
