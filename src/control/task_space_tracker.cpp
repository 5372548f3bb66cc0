#include "control/task_space_tracker.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

constexpr double kHard = 0.05;          ///< of the arm's length a rad: J is damped below
constexpr double kLargestError = 0.25;  ///< of the arm's length
constexpr double kThetaBound = 0.97;    ///< of max_theta_rad
constexpr double kLongestStep_s = 0.005;
constexpr double kLongestPrediction_s = 0.1;  ///< of d: then it rests

void require_positive(const char* name, double value) {
  if (!std::isfinite(value) || value <= 0.0) {
    throw std::invalid_argument(
        fmt::format("control, task_space.{}: expected a number > 0, got {}", name, value));
  }
}

}  // namespace

TaskSpaceTracker::TaskSpaceTracker(const ArmParameters& arm, const ControllerSettings& control,
                                   const ReferenceKind& path)
    : arm_(arm),
      gains_(control.task_space),
      path_(path),
      blend_s_(control.blend_s),
      max_theta_rad_(kThetaBound * control.max_theta_rad),
      max_speed_radps_(control.max_speed_radps),
      reach_m_(0.0) {
  require_positive("lambda_1ps", gains_.lambda_1ps);
  require_positive("tip_bandwidth_radps", gains_.tip_bandwidth_radps);
  if (!std::isfinite(gains_.posture_rate_1ps) || gains_.posture_rate_1ps < 0.0) {
    throw std::invalid_argument(
        fmt::format("control, task_space.posture_rate_1ps: expected a rate >= 0, got {}",
                    gains_.posture_rate_1ps));
  }
  for (const SegmentParameters& segment : arm_.segments) reach_m_ += segment.length_m;
  for (SegmentVector* v : {&u_, &velocity_, &acceleration_, &posture_}) v->setZero(arm_.dof());
  jacobian_.setZero(3, arm_.dof());
  jacobian_rate_.setZero(3, arm_.dof());
  join_.resize(3);
  for (SegmentVector* v : {&blended_.u, &blended_.velocity, &blended_.acceleration}) v->setZero(3);
}

void TaskSpaceTracker::start(double time_s, ConstVectorRef u, ConstVectorRef velocity,
                             const Eigen::Vector3d& tip_offset_m) noexcept {
  begin_s_ = time_s_ = offset_time_s_ = time_s;
  u_ = u;
  velocity_ = velocity;
  offset_m_ = tip_offset_m;
  offset_rate_mps_.setZero();
  limited_ = false;
  const TipReference first = path_.tip(0.0);
  tip_jacobian(arm_, u_, jacobian_);
  const SegmentVector away = tip_position(arm_, u_) + offset_m_ - first.position_m;
  const SegmentVector rate = jacobian_ * velocity_ - first.velocity_mps;
  join_.set(time_s, std::max(blend_s_, 1e-3), away, rate, -first.acceleration_mps2);
  accelerate();
  bound(kLongestStep_s);
}

// The line that fits d best with weights exp(-bandwidth age), corrected by one more measurement.
void TaskSpaceTracker::measure(double time_s, const Eigen::Vector3d& tip_m) noexcept {
  const double passed = time_s - offset_time_s_;
  if (!(passed > 0.0)) return;
  const double back = time_s - time_s_;
  posture_ = u_ + back * velocity_ + 0.5 * back * back * acceleration_;
  const Eigen::Vector3d predicted = offset(time_s);
  const Eigen::Vector3d news = tip_m - tip_position(arm_, posture_) - predicted;
  const double memory = std::exp(-gains_.tip_bandwidth_radps * passed);
  offset_m_ = predicted + (1.0 - memory * memory) * news;
  offset_rate_mps_ += (1.0 - memory) * (1.0 - memory) / passed * news;
  offset_time_s_ = time_s;
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
  out.u = u_ + ahead * velocity_ + 0.5 * ahead * ahead * acceleration_;
  out.velocity = velocity_ + ahead * acceleration_;
  out.acceleration = acceleration_;
  out.has_polar = false;
  out.limited = limited_;
  out.has_tip = true;
  out.tip = path_.tip(std::max(time_s - begin_s_, 0.0));
}

void TaskSpaceTracker::step(double duration_s) noexcept {
  u_ += duration_s * velocity_ + 0.5 * duration_s * duration_s * acceleration_;
  velocity_ += duration_s * acceleration_;
  time_s_ += duration_s;
  accelerate();
  bound(duration_s);
}

// (21) at the present state.
void TaskSpaceTracker::accelerate() noexcept {
  tip_jacobians(arm_, u_, velocity_, jacobian_, jacobian_rate_);
  const TipReference wanted = target(time_s_);
  const bool moving = time_s_ - offset_time_s_ < kLongestPrediction_s;
  Eigen::Vector3d velocity = jacobian_ * velocity_;
  if (moving) velocity += offset_rate_mps_;
  Eigen::Vector3d error = wanted.position_m - tip_position(arm_, u_) - offset(time_s_);
  const double largest = kLargestError * reach_m_, size = error.norm();
  limited_ = size > largest;
  if (limited_) error *= largest / size;

  const double lambda = gains_.lambda_1ps;
  const Eigen::Vector3d tip = wanted.acceleration_mps2 +
                              2.0 * lambda * (wanted.velocity_mps - velocity) +
                              lambda * lambda * error - jacobian_rate_ * velocity_;
  // J^+ tip + (I - J^+ J) posture, in one go.
  posture_ = -2.0 * lambda * (velocity_ + gains_.posture_rate_1ps * u_);
  const Eigen::Matrix3d inverse = damped_inverse(jacobian_, kHard * reach_m_);
  const Eigen::Vector3d force = inverse * (tip - jacobian_ * posture_);
  acceleration_.noalias() = jacobian_.transpose() * force;
  acceleration_ += posture_;
}

// Changes u'' so that after `duration_s` neither |u'| nor, at the rate 2 lambda at which it may be
// approached, theta is beyond its bound.
void TaskSpaceTracker::bound(double duration_s) noexcept {
  for (Eigen::Index i = 0; i < u_.size(); i += 2) {
    const Eigen::Vector2d u = u_.segment<2>(i), now = velocity_.segment<2>(i);
    const Eigen::Vector2d asked = now + duration_s * acceleration_.segment<2>(i);
    Eigen::Vector2d allowed = asked;
    const double theta = u.norm(), speed = asked.norm();
    if (speed > max_speed_radps_) allowed *= max_speed_radps_ / speed;
    if (theta > 0.5 * max_theta_rad_) {
      const double outward = allowed.dot(u) / theta;
      const double most = 2.0 * gains_.lambda_1ps * (max_theta_rad_ - theta);
      if (outward > most) allowed -= (outward - most) / theta * u;
    }
    if (allowed == asked) continue;
    acceleration_.segment<2>(i) = (allowed - now) / duration_s;
    limited_ = true;
  }
}

// The path, joined from where the tip was at the start.
TipReference TaskSpaceTracker::target(double time_s) noexcept {
  TipReference out = path_.tip(time_s - begin_s_);
  if (!join_.active(time_s)) return out;
  blended_.u = out.position_m;
  blended_.velocity = out.velocity_mps;
  blended_.acceleration = out.acceleration_mps2;
  join_.add(time_s, blended_);
  return {blended_.u, blended_.velocity, blended_.acceleration};
}

Eigen::Vector3d TaskSpaceTracker::offset(double time_s) const noexcept {
  return offset_m_ + std::min(time_s - offset_time_s_, kLongestPrediction_s) * offset_rate_mps_;
}

}  // namespace softarm
