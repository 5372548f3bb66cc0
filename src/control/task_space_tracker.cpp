#include "control/task_space_tracker.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

constexpr double kHard = 0.05;  ///< of the arm's length a rad: J is damped below
constexpr double kHardStretch =
    0.7;  ///< likewise at most, of what one segment's e moves the tip by
constexpr double kLargestError = 0.25;  ///< of the arm's length
constexpr double kThetaBound = 0.97;    ///< of max_theta_rad
constexpr double kLongestStep_s = 0.005;
constexpr double kJerkSmoothing_s = 0.01;  ///< measurements let u'' jump

void require_positive(const char* name, double value) {
  if (!std::isfinite(value) || value <= 0.0) {
    throw std::invalid_argument(
        fmt::format("control, task_space.{}: expected a number > 0, got {}", name, value));
  }
}

void require_not_negative(const char* name, double value) {
  if (!std::isfinite(value) || value < 0.0) {
    throw std::invalid_argument(
        fmt::format("control, task_space.{}: expected a rate >= 0, got {}", name, value));
  }
}

}  // namespace

TaskSpaceTracker::TaskSpaceTracker(const ArmParameters& arm, const ControllerSettings& control,
                                   const ReferenceKind& path,
                                   const SegmentScalars& natural_elongation_m)
    : arm_(arm),
      gains_(control.task_space),
      path_(path),
      live_(path_.get_if<LiveTipReference>()),
      blend_s_(control.blend_s),
      max_theta_rad_(kThetaBound * control.max_theta_rad),
      max_speed_radps_(control.max_speed_radps),
      reach_m_(arm.length_m()),
      offset_(gains_.tip_bandwidth_radps, gains_.map_rate_1ps, reach_m_),
      hard_mprad_(kHard * reach_m_) {
  require_positive("lambda_1ps", gains_.lambda_1ps);
  require_positive("tip_bandwidth_radps", gains_.tip_bandwidth_radps);
  require_not_negative("posture_rate_1ps", gains_.posture_rate_1ps);
  require_not_negative("map_rate_1ps", gains_.map_rate_1ps);
  for (SegmentVector* v : {&u_, &velocity_, &acceleration_, &jerk_, &posture_})
    v->setZero(arm_.dof());
  if (arm_.extensible) weigh(natural_elongation_m);
  jacobian_.setZero(3, arm_.dof());
  jacobian_rate_.setZero(3, arm_.dof());
  for (Blend* blend : {&join_, &approach_, &stop_}) blend->resize(3);
  largest_bend_.setZero(arm_.size());
  for (SegmentVector* v : {&blended_.u, &blended_.velocity, &blended_.acceleration}) v->setZero(3);
}

void TaskSpaceTracker::weigh(const SegmentScalars& natural_elongation_m) {
  rest_.setZero(arm_.dof());
  scale_.setZero(arm_.dof());
  double mean = 0.0, softest_m = reach_m_;
  for (const SegmentParameters& segment : arm_.segments)
    mean += segment.stiffness_nm_per_rad / arm_.size();
  for (int i = 0; i < arm_.size(); ++i) {
    const SegmentParameters& segment = arm_.segments[static_cast<std::size_t>(i)];
    scale_.segment<2>(3 * i).setConstant(std::sqrt(mean / segment.stiffness_nm_per_rad));
    if (segment.constant_length) continue;
    scale_[3 * i + 2] = std::sqrt(mean / segment.axial_stiffness_n_per_m);
    softest_m = std::min(softest_m, scale_[3 * i + 2]);
    rest_[3 * i + 2] = natural_elongation_m[i];
  }
  hard_mprad_ = std::min(hard_mprad_, kHardStretch * softest_m);
}

void TaskSpaceTracker::start(double time_s, ConstVectorRef u, ConstVectorRef velocity,
                             const Eigen::Vector3d& tip_offset_m) noexcept {
  begin_s_ = time_s_ = time_s;
  u_ = u;
  velocity_ = velocity;
  limited_ = false;
  jerk_.setZero();
  tip_jacobian(arm_, u_, jacobian_);
  if (live()) {  // until a target comes the tip rests where it is
    live_s_ = time_s;
    live_m_ = tip_position(arm_, u_) + tip_offset_m;
    live_mps_.setZero();
    approach_.clear();
    stop_.clear();
  }
  const TipReference first = path(time_s);
  const SegmentVector away = tip_position(arm_, u_) + tip_offset_m - first.position_m;
  const SegmentVector rate = jacobian_ * velocity_ - first.velocity_mps;
  join_.set(time_s, std::max(blend_s_, 1e-3), away, rate, -first.acceleration_mps2);
  offset_.start(time_s, tip_offset_m);
  accelerate();
  bound(kLongestStep_s);
}

void TaskSpaceTracker::measure(double time_s, const Eigen::Vector3d& tip_m) noexcept {
  const double back = time_s - time_s_;
  posture_ = u_ + back * (velocity_ + back * (0.5 * acceleration_ + back / 6.0 * jerk_));
  offset_.measure(time_s, tip_m - tip_position(arm_, posture_),
                  from_base(target(time_s)).position_m);
}

void TaskSpaceTracker::advance(double time_s) noexcept {
  const double ahead = time_s - time_s_;
  if (!(ahead > 0.0)) return;
  const int steps = static_cast<int>(
      std::clamp(std::ceil(ahead / kLongestStep_s), 1.0, static_cast<double>(kMaxSteps)));
  for (int k = 0; k < steps; ++k) step(ahead / steps);
  time_s_ = time_s;
}

void TaskSpaceTracker::sample(double time_s, ReferenceSample& out) const noexcept {
  const double ahead = time_s - time_s_;
  out.acceleration = acceleration_ + ahead * jerk_;
  out.velocity = velocity_ + ahead * (acceleration_ + 0.5 * ahead * jerk_);
  out.u = u_ + ahead * (velocity_ + ahead * (0.5 * acceleration_ + ahead / 6.0 * jerk_));
  out.has_polar = false;
  out.limited = limited_;
  out.has_tip = true;
  out.tip = path(std::max(time_s, begin_s_));
}

void TaskSpaceTracker::step(double duration_s) noexcept {
  u_ += duration_s * velocity_ + 0.5 * duration_s * duration_s * acceleration_;
  velocity_ += duration_s * acceleration_;
  time_s_ += duration_s;
  jerk_ -= acceleration_ / kJerkSmoothing_s;
  accelerate();
  bound(duration_s);
  jerk_ += acceleration_ / kJerkSmoothing_s;
  jerk_ *= limited_ ? 0.0 : kJerkSmoothing_s / (kJerkSmoothing_s + duration_s);
}

// (21) at the present state.
void TaskSpaceTracker::accelerate() noexcept {
  tip_jacobians(arm_, u_, velocity_, jacobian_, jacobian_rate_);
  const TipReference wanted = target(time_s_);
  const TipReference offset = offset_.at(time_s_, from_base(wanted));
  const Eigen::Vector3d velocity = jacobian_ * velocity_ + offset.velocity_mps;
  Eigen::Vector3d error = wanted.position_m - tip_position(arm_, u_) - offset.position_m;
  const double largest = kLargestError * reach_m_, size = error.norm();
  limited_ = size > largest;
  if (limited_) error *= largest / size;

  const double lambda = gains_.lambda_1ps;
  const Eigen::Vector3d tip = wanted.acceleration_mps2 - offset.acceleration_mps2 +
                              2.0 * lambda * (wanted.velocity_mps - velocity) +
                              lambda * lambda * error - jacobian_rate_ * velocity_;
  // J^+ tip + (I - J^+ J) posture, in one go.
  if (arm_.extensible) {
    posture_ = -2.0 * lambda * (velocity_ + gains_.posture_rate_1ps * (u_ - rest_));
    const Eigen::Vector3d rest = tip - jacobian_ * posture_;
    for (Eigen::Index j = 0; j < scale_.size(); ++j) jacobian_.col(j) *= scale_[j];
    const Eigen::Vector3d force = damped_inverse(jacobian_, hard_mprad_) * rest;
    acceleration_.noalias() = jacobian_.transpose() * force;
    acceleration_.array() *= scale_.array();
    acceleration_ += posture_;
    return;
  }
  posture_ = -2.0 * lambda * (velocity_ + gains_.posture_rate_1ps * u_);
  const Eigen::Matrix3d inverse = damped_inverse(jacobian_, hard_mprad_);
  const Eigen::Vector3d force = inverse * (tip - jacobian_ * posture_);
  acceleration_.noalias() = jacobian_.transpose() * force;
  acceleration_ += posture_;
}

TipReference TaskSpaceTracker::path(double time_s) const noexcept {
  if (!live()) return path_.tip(time_s - begin_s_);
  const double age = std::max(time_s - live_s_, 0.0);
  const bool goes_on = age < live_->timeout_s;
  blended_.u = live_m_ + (goes_on ? age : live_->timeout_s + 0.5 * stop_s_) * live_mps_;
  blended_.velocity.setZero();
  blended_.acceleration.setZero();
  if (goes_on) blended_.velocity = live_mps_;
  if (!goes_on) stop_.add(time_s, blended_);
  if (approach_.active(time_s)) approach_.add(time_s, blended_);
  return {blended_.u, blended_.velocity, blended_.acceleration};
}

void TaskSpaceTracker::retarget(double time_s, const Eigen::Vector3d& position_m,
                                const Eigen::Vector3d& velocity_mps) noexcept {
  constexpr double kShortest_s = 0.05, kQuinticPeakAcceleration = 5.7735;
  const TipReference now = path(time_s);
  const SegmentVector away = now.position_m - position_m;
  const SegmentVector rate = now.velocity_mps - velocity_mps;
  const double speed =
      std::max(live_->max_speed_mps - velocity_mps.norm(), 0.25 * live_->max_speed_mps);
  const double acceleration = live_->max_acceleration_mps2;
  const double duration =
      std::max({kShortest_s, kQuinticPeakSpeed * away.norm() / speed,
                std::sqrt(kQuinticPeakAcceleration * away.norm() / acceleration),
                4.0 * rate.norm() / acceleration});
  approach_.set(time_s, duration, away, rate, now.acceleration_mps2);
  live_s_ = time_s;
  live_m_ = position_m;
  live_mps_ = velocity_mps;
  // It comes to rest half as far on as it would have gone in that time: without turning back.
  stop_s_ = std::max(kShortest_s, 4.0 * velocity_mps.norm() / acceleration);
  const SegmentVector goes_on = velocity_mps, ahead = -0.5 * stop_s_ * velocity_mps;
  stop_.set(time_s + live_->timeout_s, stop_s_, ahead, goes_on, SegmentVector::Zero(3));
}

// Changes u'' so that after `duration_s` neither |u'| nor, at the rate 2 lambda at which it may be
// approached, theta is beyond its bound.
void TaskSpaceTracker::bound(double duration_s) noexcept {
  if (hold_ != nullptr) hold_->largest_bend(u_, largest_bend_);
  for (Eigen::Index i = 0; i < u_.size(); i += arm_.segment_dof()) {
    const Eigen::Vector2d u = u_.segment<2>(i), now = velocity_.segment<2>(i);
    const Eigen::Vector2d asked = now + duration_s * acceleration_.segment<2>(i);
    Eigen::Vector2d allowed = asked;
    const double theta = u.norm(), speed = asked.norm();
    if (speed > max_speed_radps_) allowed *= max_speed_radps_ / speed;
    const double bend = hold_ != nullptr
                            ? std::min(max_theta_rad_, kThetaBound * largest_bend_[i / 2])
                            : max_theta_rad_;
    if (theta > 0.5 * bend && theta > 0.0) {
      const double outward = allowed.dot(u) / theta;
      const double most = 2.0 * gains_.lambda_1ps * (bend - theta);
      if (outward > most) allowed -= (outward - most) / theta * u;
    }
    if (allowed == asked) continue;
    acceleration_.segment<2>(i) = (allowed - now) / duration_s;
    limited_ = true;
  }
}

// The path, joined from where the tip was at the start.
TipReference TaskSpaceTracker::target(double time_s) noexcept {
  TipReference out = path(time_s);
  if (!join_.active(time_s)) return out;
  blended_.u = out.position_m;
  blended_.velocity = out.velocity_mps;
  blended_.acceleration = out.acceleration_mps2;
  join_.add(time_s, blended_);
  return {blended_.u, blended_.velocity, blended_.acceleration};
}

}  // namespace softarm
