#include "model/augmented_map.hpp"

#include <cmath>

#include "model/entire_series.hpp"

namespace softarm {

CentreOfMass centre_of_mass(double length_m, double theta_rad) noexcept {
  const double y = 0.5 * theta_rad, s = y * y;
  const auto c = entire<8>(s);
  // j0, j1 / y and j2 / y^2. They obey j0' = -j1 and (j1 / y)' = -j2 / y.
  const double f = c[1];
  const double e = c[2] - c[3];
  const double g = c[3] - 3.0 * c[4] + 3.0 * c[5];
  const double h = y * e;

  // r = |f + i h| and its derivatives with respect to y; f and h have no zero in common.
  const double r_squared = f * f + h * h;
  const double r = std::sqrt(r_squared);
  const double r_1 = -2.0 * h * e / r;
  const double r_2 = (4.0 * s * e * g - 2.0 * e * e - r_1 * r_1) / r;
  const double eta_1 = 1.0 - 2.0 * f * e / r_squared;
  const double eta_2 = 2.0 * y * ((e * e + f * g) - 4.0 * f * e * e * e / r_squared) / r_squared;

  const double half = 0.5 * length_m;  // and dy / dtheta = 1/2
  return {.b = half * r,
          .b_1 = 0.5 * half * r_1,
          .b_2 = 0.25 * half * r_2,
          .eta = std::atan2(h, f),
          .eta_1 = 0.5 * eta_1,
          .eta_2 = 0.25 * eta_2};
}

SegmentMap segment_map(double length_m, const Eigen::Vector2d& q,
                       const Eigen::Vector2d& velocity) noexcept {
  const double phi = q.x(), theta = q.y(), theta_rate = velocity.y();
  const CentreOfMass m = centre_of_mass(length_m, theta);
  const double rest = 0.5 * theta - m.eta, rest_1 = 0.5 - m.eta_1, rest_2 = -m.eta_2;
  SegmentMap map;
  map.xi << phi, rest, m.b, m.eta, -phi, phi, m.eta, m.b, rest, -phi;
  map.jacobian.col(0) << 1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, -1.0;
  map.jacobian.col(1) << 0.0, rest_1, m.b_1, m.eta_1, 0.0, 0.0, m.eta_1, m.b_1, rest_1, 0.0;
  map.jacobian_rate.col(0).setZero();
  map.jacobian_rate.col(1) << 0.0, rest_2, m.b_2, m.eta_2, 0.0, 0.0, m.eta_2, m.b_2, rest_2, 0.0;
  map.jacobian_rate.col(1) *= theta_rate;
  return map;
}

}  // namespace softarm
