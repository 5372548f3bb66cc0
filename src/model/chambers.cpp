#include "softarm/model/chambers.hpp"

#include <cmath>

namespace softarm {

double fibre_length(double length_m, const Eigen::Vector2d& u_rad, double offset_m,
                    double angle_rad) noexcept {
  return length_m - offset_m * (u_rad.x() * std::cos(angle_rad) + u_rad.y() * std::sin(angle_rad));
}

Eigen::Vector3d chamber_force(const ChamberGeometry& chambers,
                              std::span<const double> pressures_bar) noexcept {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (std::size_t j = 0; j < chambers.angles_rad.size(); ++j) {
    const double push = chambers.area_n_per_bar * pressures_bar[j];
    const double moment = -chambers.offset_m * push;
    force += Eigen::Vector3d(moment * std::cos(chambers.angles_rad[j]),
                             moment * std::sin(chambers.angles_rad[j]), push);
  }
  return force;
}

}  // namespace softarm
