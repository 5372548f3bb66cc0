#include <Eigen/Geometry>

#include "softarm/model/coordinates.hpp"
#include "softarm/model/model_correction.hpp"

namespace softarm {

HorizontalLoad::HorizontalLoad(const ArmParameters& arm) : arm_x_(arm), arm_y_(arm) {
  const double g = arm.gravity_mps2.norm();
  const Eigen::Vector3d down =
      g > 0.0 ? Eigen::Vector3d(arm.gravity_mps2 / g) : Eigen::Vector3d(-Eigen::Vector3d::UnitZ());
  // The world axis that is least along gravity, made orthogonal to it: x where z is up.
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
  if (std::abs(down.y()) < std::abs(down.x())) axis = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d e_x = (axis - axis.dot(down) * down).normalized();
  arm_x_.gravity_mps2 = g * e_x;
  arm_y_.gravity_mps2 = g * e_x.cross(down);
}

void HorizontalLoad::set_lengths(ConstVectorRef length_m) noexcept {
  softarm::set_lengths(arm_x_, length_m);
  softarm::set_lengths(arm_y_, length_m);
}

void HorizontalLoad::rows(ConstVectorRef u, DynamicsWorkspace& workspace, VectorRef along_x,
                          VectorRef along_y) const noexcept {
  constexpr DynamicsTerms kGravity{false, false, true};
  inverse_dynamics(arm_x_, workspace, u, u, u, u, kGravity, along_x);
  inverse_dynamics(arm_y_, workspace, u, u, u, u, kGravity, along_y);
}

}  // namespace softarm
