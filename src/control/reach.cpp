#include "softarm/control/reach.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

constexpr int kSteps = 60;
constexpr double kLongestStep_rad = 0.5;
constexpr double kGoodEnough = 1e-4;  ///< of the arm's length

}  // namespace

TipSearch::TipSearch(const ArmParameters& arm, double max_theta_rad,
                     std::optional<double> plane_rad, const SegmentScalars& most_elongation_m)
    : arm_(arm),
      max_theta_rad_(max_theta_rad),
      length_m_(arm.length_m()),
      plane_rad_(plane_rad),
      most_elongation_m_(most_elongation_m),
      best_(SegmentVector::Zero(arm.dof())),
      u_(best_),
      step_(best_),
      jacobian_(3, arm.dof()) {}

/// Within the limits on theta and e, and in the plane of a planar arm.
void TipSearch::project(SegmentVector& u) const noexcept {
  for (Eigen::Index i = 0; i < most_elongation_m_.size(); ++i)
    u[3 * i + 2] = std::clamp(u[3 * i + 2], 0.0, most_elongation_m_[i]);
  for (Eigen::Index i = 0; i < u.size(); i += arm_.segment_dof()) {
    if (plane_rad_) {
      const Eigen::Vector2d along(std::cos(*plane_rad_), std::sin(*plane_rad_));
      u.segment<2>(i) = along * along.dot(u.segment<2>(i));
    }
    const double theta = u.segment<2>(i).norm();
    if (theta > max_theta_rad_) u.segment<2>(i) *= max_theta_rad_ / theta;
  }
}

bool TipSearch::found() const noexcept { return nearest_m_ <= kGoodEnough * length_m_; }

void TipSearch::begin(const Eigen::Vector3d& target_m, ConstVectorRef u_rad) noexcept {
  target_m_ = target_m;
  best_ = u_rad;
  nearest_m_ = (target_m - tip_position(arm_, u_rad)).norm();
  steps_ = 0;
}

void TipSearch::search(ConstVectorRef start, int steps) noexcept {
  u_ = start;
  for (int k = 0; k < steps && !found(); ++k, ++steps_) {
    project(u_);
    const Eigen::Vector3d error = target_m_ - tip_position(arm_, u_);
    if (error.norm() < nearest_m_) {
      nearest_m_ = error.norm();
      best_ = u_;
    }
    tip_jacobian(arm_, u_, jacobian_);
    Eigen::Matrix3d normal = jacobian_ * jacobian_.transpose();
    normal.diagonal().array() += 0.05 * error.squaredNorm() + 1e-8 * length_m_ * length_m_;
    const Eigen::Vector3d force = normal.llt().solve(error);
    step_.noalias() = jacobian_.transpose() * force;
    u_ += step_ * std::min(1.0, kLongestStep_rad / std::max(step_.norm(), 1e-12));
  }
}

void TipSearch::search_from_arc(double part, int steps) noexcept {
  const Eigen::Vector3d local = arm_.base_rotation.transpose() * (target_m_ - arm_.base_position_m);
  const double towards = std::atan2(local.y(), local.x());
  SegmentVector bend = best_;  // and its elongations
  for (Eigen::Index i = 0; i < bend.size(); i += arm_.segment_dof())
    bend.segment<2>(i) =
        part * max_theta_rad_ * Eigen::Vector2d(std::cos(towards), std::sin(towards));
  search(bend, steps);
}

double distance_out_of_reach_m(const ArmParameters& arm, double max_theta_rad,
                               std::optional<double> plane_rad, const Eigen::Vector3d& target_m,
                               Eigen::VectorXd& u_rad, const SegmentScalars& most_elongation_m) {
  TipSearch tip(arm, max_theta_rad, plane_rad, most_elongation_m);
  tip.begin(target_m, u_rad);
  tip.search(u_rad, kSteps);
  for (const double part : {0.1, 0.5, -0.3, 0.9}) tip.search_from_arc(part, kSteps);
  u_rad = tip.u_rad();
  return tip.distance_m();
}

}  // namespace softarm
