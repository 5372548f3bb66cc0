// Elements that remember: play operators (Prandtl-Ishlinskii hysteresis) and a Maxwell element.
// Each is one state a direction, free of allocation and bounded, for simulation, identification and
// feed-forward alike.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace softarm {

/// The play operator of one direction, backlash: `output` stays where it is until `input` leaves
/// output +- half_width, and then follows at that distance. Along a monotone input its result
/// depends on the last value alone. Weighted sums of it are the Prandtl-Ishlinskii model.
inline double play(double output, double input, double half_width) noexcept {
  return std::clamp(output, input - half_width, input + half_width);
}

/// The play operator of a vector: its centre is dragged by u at a distance of at most `radius`.
/// Independent of rate and of the directions of the axes; for one direction, the scalar play
/// operator of Prandtl and Ishlinskii.
/// @return the centre after u
inline Eigen::Vector2d play(const Eigen::Vector2d& centre, const Eigen::Vector2d& u,
                            double radius) noexcept {
  const Eigen::Vector2d off = u - centre;
  const double distance = off.norm();
  return distance > radius ? Eigen::Vector2d(centre + (1.0 - radius / distance) * off) : centre;
}

/// A spring that slips at a bend of `radius` (the stop operator u - play(u), a Maxwell-slip
/// element): its force opposes the motion and is at most stiffness times radius. Several in parallel
/// make loops of any convex shape; all weights >= 0 dissipate.
struct SlipSpring {
  double radius_rad = 0.0;
  double stiffness_nm_per_rad = 0.0;

  /// The moment at u, from the centre before; N m.
  Eigen::Vector2d moment(const Eigen::Vector2d& centre, const Eigen::Vector2d& u) const noexcept {
    return stiffness_nm_per_rad * (u - play(centre, u, radius_rad));
  }
  /// Its slope in u, symmetric and not negative.
  Eigen::Matrix2d slope(const Eigen::Vector2d& centre, const Eigen::Vector2d& u) const noexcept {
    const Eigen::Vector2d off = u - centre;
    const double distance = off.norm();
    if (distance <= radius_rad) return stiffness_nm_per_rad * Eigen::Matrix2d::Identity();
    const Eigen::Vector2d along = off / distance;
    return stiffness_nm_per_rad * radius_rad / distance *
           (Eigen::Matrix2d::Identity() - along * along.transpose());
  }
};

/// A rest that creeps after use: z' = (share x - z) / time_s. As an elastic force k (x - z) it is a
/// spring beside a Maxwell element (the standard linear solid): k (1 - share) in the long run.
struct Remanence {
  double share = 0.0;
  double time_s = 30.0;

  /// z after `step_s` of a held x; exact.
  double step(double z, double x, double step_s) const noexcept {
    const double target = share * x;
    return target + (z - target) * std::exp(-step_s / time_s);
  }
};

}  // namespace softarm
