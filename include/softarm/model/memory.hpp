// Elements that remember: play operators (Prandtl-Ishlinskii hysteresis), the model of Bouc and Wen,
// and a Maxwell element. Each is one state a direction, free of allocation and bounded, for
// simulation, identification and feed-forward alike.
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

/// Hysteresis of Bouc and Wen in two directions (Park, Wen and Ang 1986, for any exponent): z follows
/// the bend u until it saturates at |z| = limit_rad,
///     dz = du - (|z| / limit_rad)^exponent z_ (shape |du.z_| + (1 - shape) du.z_),  z_ = z / |z|.
/// Independent of rate and of the directions of the axes. Smooth where slip springs have corners:
/// along u from rest with exponent 1, z = limit_rad (1 - exp(-u / limit_rad)). A moment k z, k > 0,
/// dissipates in every closed loop of u where shape >= 1/2.
struct BoucWen {
  double limit_rad = 0.1;
  double exponent = 1.0;  ///< >= 1; the larger, the sharper the knee
  double shape = 0.5;     ///< beta / (beta + gamma) of the literature, in [1/2, 1]

  /// z after the bend has moved by `du` along a straight line: Runge and Kutta's fourth order, in
  /// parts of at most limit_rad / (2 + 2 exponent), as z settles within limit_rad / exponent; 1000 at
  /// most.
  Eigen::Vector2d step(Eigen::Vector2d z, const Eigen::Vector2d& du) const noexcept {
    const int parts =
        1 + static_cast<int>(std::min(999.0, (2.0 + 2.0 * exponent) * du.norm() / limit_rad));
    const Eigen::Vector2d part = du / parts;
    for (int i = 0; i < parts; ++i) {
      const Eigen::Vector2d a = slope(z, part), b = slope(z + 0.5 * a, part);
      const Eigen::Vector2d c = slope(z + 0.5 * b, part), d = slope(z + c, part);
      z += (a + 2.0 * b + 2.0 * c + d) / 6.0;
    }
    return z;
  }

 private:
  Eigen::Vector2d slope(const Eigen::Vector2d& z, const Eigen::Vector2d& du) const noexcept {
    const double size = z.norm();
    if (size == 0.0) return du;
    const double along = du.dot(z) / size;
    const double yields =
        std::pow(size / limit_rad, exponent) * (shape * std::abs(along) + (1.0 - shape) * along);
    return du - yields / size * z;
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
