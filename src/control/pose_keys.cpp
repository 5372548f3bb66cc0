// The keys of a pose: curvatures of all segments.
#include <cmath>
#include <numbers>

#include "softarm/base/keys.hpp"
#include "softarm/control/reference_kinds.hpp"

namespace softarm {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

void describe_pose(Keys& key, std::vector<double>& u_rad, Presence presence) {
  const auto n = static_cast<std::size_t>(key.segments);
  u_rad.resize(2 * n, 0.0);
  const auto as_u = [&] {
    key("u_rad", u_rad, from(-kTwoPi, kTwoPi).one_or_pairs(),
        "[x, y] of every segment, u = theta [cos phi, sin phi]", presence);
  };
  key.either("u_rad", as_u, "theta_rad", [&] {
    std::vector<double> theta(n), phi(n);
    for (std::size_t i = 0; i < n; ++i) {
      theta[i] = std::hypot(u_rad[2 * i], u_rad[2 * i + 1]);
      phi[i] = theta[i] > 0.0 ? std::atan2(u_rad[2 * i + 1], u_rad[2 * i]) : 0.0;
    }
    key("theta_rad", theta, from(-kTwoPi, kTwoPi).one_or_each(),
        "bend of all segments, or a list (or u_rad: [[x, y], ...])", presence);
    key("phi_rad", phi, from(-kTwoPi, kTwoPi).one_or_each(),
        "direction of the bend of all segments, or a list");
    for (std::size_t i = 0; i < n && key.reading(); ++i) {
      // Adding zero makes a negative zero positive, so that what is printed reads back the same.
      u_rad[2 * i] = theta[i] * std::cos(phi[i]) + 0.0;
      u_rad[2 * i + 1] = theta[i] * std::sin(phi[i]) + 0.0;
    }
  });
}

}  // namespace softarm
