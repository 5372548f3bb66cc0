#include "softarm/control/reach.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

constexpr int kIterations = 60;
constexpr double kLongestStep_rad = 0.5;
constexpr double kGoodEnough = 1e-4;  ///< of the arm's length

/// Within the limits on theta, and in the plane of a planar arm.
void project(double max_theta_rad, std::optional<double> plane_rad,
             const SegmentScalars& most_elongation_m, Eigen::Index width, Eigen::VectorXd& u) {
  for (Eigen::Index i = 0; i < most_elongation_m.size(); ++i)
    u[3 * i + 2] = std::clamp(u[3 * i + 2], 0.0, most_elongation_m[i]);
  for (Eigen::Index i = 0; i < u.size(); i += width) {
    if (plane_rad) {
      const Eigen::Vector2d along(std::cos(*plane_rad), std::sin(*plane_rad));
      u.segment<2>(i) = along * along.dot(u.segment<2>(i));
    }
    const double theta = u.segment<2>(i).norm();
    if (theta > max_theta_rad) u.segment<2>(i) *= max_theta_rad / theta;
  }
}

double length_m(const ArmParameters& arm) {
  double sum = 0.0;
  for (const SegmentParameters& segment : arm.segments) sum += segment.length_m;
  return sum;
}

}  // namespace

double distance_out_of_reach_m(const ArmParameters& arm, double max_theta_rad,
                               std::optional<double> plane_rad, const Eigen::Vector3d& target_m,
                               Eigen::VectorXd& u_rad, const SegmentScalars& most_elongation_m) {
  const double length = length_m(arm);
  const Eigen::Vector3d local = arm.base_rotation.transpose() * (target_m - arm.base_position_m);
  const double towards = std::atan2(local.y(), local.x());
  Eigen::VectorXd best = u_rad;
  double nearest_m = (target_m - tip_position(arm, u_rad)).norm();
  Eigen::Matrix3Xd jacobian(3, arm.dof());
  const auto search = [&](Eigen::VectorXd u) {
    for (int k = 0; k < kIterations && nearest_m > kGoodEnough * length; ++k) {
      project(max_theta_rad, plane_rad, most_elongation_m, arm.segment_dof(), u);
      const Eigen::Vector3d error = target_m - tip_position(arm, u);
      if (error.norm() < nearest_m) {
        nearest_m = error.norm();
        best = u;
      }
      tip_jacobian(arm, u, jacobian);
      Eigen::Matrix3d normal = jacobian * jacobian.transpose();
      normal.diagonal().array() += 0.05 * error.squaredNorm() + 1e-8 * length * length;
      Eigen::VectorXd step = jacobian.transpose() * normal.llt().solve(error);
      const double size = step.norm();
      u += step * std::min(1.0, kLongestStep_rad / std::max(size, 1e-12));
    }
  };
  search(u_rad);
  for (const double part : {0.1, 0.5, -0.3, 0.9}) {
    Eigen::VectorXd bend = u_rad;
    for (Eigen::Index i = 0; i < bend.size(); i += arm.segment_dof())
      bend.segment<2>(i) =
          part * max_theta_rad * Eigen::Vector2d(std::cos(towards), std::sin(towards));
    search(bend);
  }
  u_rad = best;
  return nearest_m;
}

}  // namespace softarm
