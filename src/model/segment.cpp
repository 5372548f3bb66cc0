#include "softarm/model/segment.hpp"

#include "model/segment_geometry.hpp"

namespace softarm {
namespace {

using Columns = Eigen::Matrix<double, 3, 2>;

Columns to_columns(const PairVector3& pair) noexcept {
  Columns result;
  result << pair.x[0], pair.x[1], pair.y[0], pair.y[1], pair.z[0], pair.z[1];
  return result;
}

}  // namespace

Eigen::Matrix3d segment_rotation(const Eigen::Vector2d& u_rad) noexcept {
  const auto c = entire<8>(u_rad.squaredNorm());
  const double x = u_rad.x(), y = u_rad.y();
  Eigen::Matrix3d result;
  result << 1.0 - c[2] * x * x, -c[2] * x * y, c[1] * x,  //
      -c[2] * x * y, 1.0 - c[2] * y * y, c[1] * y,        //
      -c[1] * x, -c[1] * y, c[0];
  return result;
}

Eigen::Vector3d segment_tip(double length_m, const Eigen::Vector2d& u_rad) noexcept {
  const auto c = entire<8>(u_rad.squaredNorm());
  return length_m * Eigen::Vector3d(c[2] * u_rad.x(), c[2] * u_rad.y(), c[1]);
}

Eigen::Vector3d segment_centre(double length_m, const Eigen::Vector2d& u_rad) noexcept {
  const auto c = entire<8>(u_rad.squaredNorm());
  return length_m * Eigen::Vector3d(c[3] * u_rad.x(), c[3] * u_rad.y(), c[2]);
}

Eigen::Vector3d segment_point(double length_m, const Eigen::Vector2d& u_rad,
                              double arc_fraction) noexcept {
  // The first x of the arc is itself a segment of length x L bent by x u.
  return segment_tip(arc_fraction * length_m, arc_fraction * u_rad);
}

Columns segment_angular_jacobian(const Eigen::Vector2d& u_rad) noexcept {
  const auto c = entire<8>(u_rad.squaredNorm());
  return to_columns(columns(spin(c), u_rad.x(), u_rad.y()));
}

}  // namespace softarm
