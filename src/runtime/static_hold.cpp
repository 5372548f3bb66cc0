#include "softarm/runtime/static_hold.hpp"

#include <algorithm>
#include <cmath>

#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/statics.hpp"

namespace softarm {
namespace {

double beyond_nm(const ActuationSettings& actuation) {
  double most = 1.0;
  for (std::size_t i = 0; i < actuation.segments.size(); ++i)
    most = std::max(most, 2.0 * largest_force(actuation, i).moment_nm);
  return most;
}

}  // namespace

StaticHold::StaticHold(const ArmParameters& arm, const ActuationSettings& actuation)
    : arm_(arm),
      plane_rad_(actuation.plane_rad),
      workspace_(arm),
      allocator_(actuation),
      beyond_nm_(beyond_nm(actuation)),
      force_nm_(SegmentVector::Zero(arm.dof())),
      torque_nm_(force_nm_),
      scale_(SegmentScalars::Zero(arm.size())) {}

// Along the moment that holds u the chambers reach further, by what is spare; the spring takes that
// up as more bend.
void StaticHold::largest_bend(ConstVectorRef u_rad, VectorRef theta_rad) noexcept {
  static_moments(arm_, workspace_, u_rad, force_nm_);
  solve_actuation(arm_, u_rad, force_nm_, torque_nm_);
  for (int i = 0; i < arm_.size(); ++i) {
    auto torque = torque_nm_.segment<2>(2 * i);
    if (plane_rad_) {  // its structure carries the rest
      const Eigen::Vector2d plane(-std::sin(*plane_rad_), std::cos(*plane_rad_));
      torque = plane * plane.dot(torque);
    }
    theta_rad[i] = torque.norm();  // what is needed, N m, until it becomes the bend below
    // Where none is needed, that which would bend it further.
    if (theta_rad[i] < 1e-9 * beyond_nm_) {
      theta_rad[i] = 0.0;
      torque = Eigen::Vector2d(-u_rad[2 * i + 1], u_rad[2 * i]);
    }
    const double size = torque.norm();
    torque *= size > 0.0 ? beyond_nm_ / size : 0.0;
    if (size == 0.0) torque[0] = beyond_nm_;
  }
  allocator_.largest_scale(torque_nm_, scale_);
  for (int i = 0; i < arm_.size(); ++i) {
    const double spare_nm = scale_[i] * beyond_nm_ - theta_rad[i];
    const double stiffness = arm_.segments[static_cast<std::size_t>(i)].stiffness_nm_per_rad;
    theta_rad[i] = u_rad.segment<2>(2 * i).norm() + spare_nm / stiffness;
  }
}

}  // namespace softarm
