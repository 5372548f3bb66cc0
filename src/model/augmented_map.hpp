// m(q) of (6) for one segment: where the ten joints of Table I stand for [phi, theta], and how they
// move.
#pragma once

#include <Eigen/Core>

namespace softarm {

/// b and eta of (7) and (8) with their first two derivatives with respect to theta, free of
/// cancellation for theta of either sign.
///
/// With y = theta / 2 the centre of mass, seen from the segment's base, lies at
/// (L / 2) (j0(y) + i j1(y)), turned by theta / 2 out of the base's axis; j0 = c1 and
/// j1 = y (c2 - c3) are the spherical Bessel functions. So b = (L / 2) |j0 + i j1| > 0 is even and
/// eta = arg(j0 + i j1) is odd; arccos as in (8) loses half of the digits near 0 and the sign. The
/// argument steps by 2 pi where j1 changes sign with j0 < 0 (first at |theta| = 8.99), to which
/// sines and cosines are blind.
struct CentreOfMass {
  double b, b_1, b_2;        ///< m, m/rad, m/rad^2
  double eta, eta_1, eta_2;  ///< rad, 1, 1/rad
};
CentreOfMass centre_of_mass(double length_m, double theta_rad) noexcept;

inline constexpr int kJointsPerSegment = 10;

/// The ten rows of (6), of J_m = dm/dq (columns phi and theta) and of d J_m / dt.
struct SegmentMap {
  Eigen::Matrix<double, kJointsPerSegment, 1> xi;
  Eigen::Matrix<double, kJointsPerSegment, 2> jacobian, jacobian_rate;
};
SegmentMap segment_map(double length_m, const Eigen::Vector2d& q,
                       const Eigen::Vector2d& velocity) noexcept;

}  // namespace softarm
