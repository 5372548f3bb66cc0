#include "estimation/orientation_noise.hpp"

#include <algorithm>

#include "softarm/model/entire_functions.hpp"

namespace softarm {

BodyNoiseJacobians body_noise_jacobians(const Eigen::Vector2d& u) noexcept {
  constexpr double kLeastSinc = 0.05;
  // Along the bend an error counts in full, across it by a = (theta / 2) cot(theta / 2); about the
  // segment's own axis it turns the bend by half. a = c0 / c1 and (1 - a) / theta^2 = (c2 - c3) /
  // (4 c1) at (theta / 2)^2.
  const auto c = entire_functions(0.25 * u.squaredNorm());
  const double c1 = std::max(c[1], kLeastSinc);
  const double across = c[0] / c1, rest = 0.25 * (c[2] - c[3]) / c1;
  Eigen::Matrix2d plane = rest * u * u.transpose();
  plane.diagonal().array() += across;
  BodyNoiseJacobians out;
  out.lower << -plane.col(1), plane.col(0), 0.5 * Eigen::Vector2d(u.y(), -u.x());
  out.upper = out.lower;
  out.upper.col(2) = -out.lower.col(2);
  return out;
}

}  // namespace softarm
