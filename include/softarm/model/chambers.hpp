// What pressure in chambers along a segment does to u and e, by virtual work: the volume of a
// chamber is its area times the length of the fibre through its centroid, whatever its shape.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "softarm/model/arm.hpp"

namespace softarm {

inline constexpr int kMaxChambersPerSegment = 8;
inline constexpr int kMaxChambers = kMaxChambersPerSegment * kMaxSegments;

/// One pressure per chamber (bar), segment by segment in the order of the valves. Storage in place:
/// never allocates.
using PressureVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxChambers, 1>;

/// The chambers of one segment, all of one area and with their centroids as far from the axis.
struct ChamberGeometry {
  std::vector<double> angles_rad;  ///< chi of each, from the x axis of S_{i-1}
  double offset_m = 0.0125;        ///< r
  double area_n_per_bar = 67.12;   ///< a; a r is the gain in N m per bar
};

/// Length of the fibre at `offset_m` from the axis and at `angle_rad` about it, in m:
/// l - r (u_x cos chi + u_y sin chi), exact for constant curvature. The model is meant for fibres of
/// positive length, r theta < l.
/// @param length_m l, the segment's present length.
double fibre_length(double length_m, const Eigen::Vector2d& u_rad, double offset_m,
                    double angle_rad) noexcept;

/// Generalized force of the pressures (bar, one a chamber) on (u_x, u_y, e), in N m, N m, N: the sum
/// of p a (-r cos chi, -r sin chi, 1). The same as A_chamber tau_A with N = a sum p.
Eigen::Vector3d chamber_force(const ChamberGeometry& chambers,
                              std::span<const double> pressures_bar) noexcept;

}  // namespace softarm
