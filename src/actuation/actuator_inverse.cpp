#include "softarm/actuation/actuator_inverse.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "softarm/model/actuation_matrix.hpp"

namespace softarm {
namespace {

/// Each takes what the one before left over.
constexpr int kSteps = 4;

/// What lasts longer than this is no hysteresis that a motion shows.
constexpr double kForget_s = 10.0;
/// Time in which weights follow what they should be, where they are excited.
constexpr double kLearning_s = 10.0;
constexpr double kMostLearnt = 0.6;
/// Slack of less than this part of the chambers' largest force shows nothing.
constexpr double kLeastSlack = 1e-3;

double approach(double period_s, double lag_s) {
  return lag_s > 0.0 ? -std::expm1(-period_s / lag_s) : 1.0;
}

void check(const ActuationSettings& actuation, const ActuatorInverseSettings& it,
           double valve_lag_s) {
  const auto expect = [](bool holds, const char* expected, double got) {
    if (!holds)
      throw std::invalid_argument(
          fmt::format("actuation.inverse: expected {}, got {}", expected, got));
  };
  const auto chambers = static_cast<std::size_t>(chamber_count(actuation));
  expect(actuation.kind == ActuationKind::chambers, "chambers, not torque", 1.0);
  for (const std::vector<double>* lags : {&it.fill_lag_s, &it.vent_lag_s}) {
    expect(lags->empty() || lags->size() == chambers, "a lag of every chamber",
           static_cast<double>(lags->size()));
    for (const double lag_s : *lags)
      expect(std::isfinite(lag_s) && lag_s >= 0.0, "lags >= 0 s", lag_s);
  }
  expect(!it.lags() || valve_lag_s > 0.0,
         "control.valve_lag_s > 0, the lag that the inverse leaves", valve_lag_s);
  expect(it.hysteresis >= 0.0 && it.hysteresis < 1.0, "a hysteresis in [0, 1)", it.hysteresis);
  for (const double width_bar : it.play_bar)
    expect(std::isfinite(width_bar) && width_bar >= 0.0, "play_bar >= 0", width_bar);
  expect(it.slip_radius_rad.size() == it.slip_stiffness_nm_per_rad.size(),
         "as many slip_stiffness_nm_per_rad as slip_radius_rad",
         static_cast<double>(it.slip_stiffness_nm_per_rad.size()));
  expect(std::isfinite(it.stiffening_per_bar) && it.stiffening_per_bar >= 0.0,
         "stiffening_per_bar >= 0", it.stiffening_per_bar);
}

}  // namespace

ActuatorInverse::ActuatorInverse(const ArmParameters& arm, const ActuationSettings& actuation,
                                 const ActuatorInverseSettings& settings, double valve_lag_s,
                                 double period_s)
    : arm_(arm),
      min_bar_(actuation.min_pressure_bar),
      max_bar_(actuation.max_pressure_bar),
      stiffening_per_bar_(settings.stiffening_per_bar),
      changes_torque_(settings.stiffening_per_bar > 0.0 || settings.slips()),
      learns_(settings.learn_hysteresis && !settings.play_bar.empty()),
      period_s_(period_s),
      target_lag_s_(valve_lag_s),
      target_approach_(approach(period_s, valve_lag_s)),
      hysteresis_(settings.hysteresis, settings.play_bar, chamber_count(actuation)),
      pressure_bar_(PressureVector::Zero(chamber_count(actuation))),
      acting_bar_(pressure_bar_),
      asked_bar_(pressure_bar_),
      tau_nm_(SegmentVector::Zero(arm.dof())),
      force_nm_(tau_nm_),
      effective_nm_(tau_nm_),
      material_nm_(tau_nm_) {
  check(actuation, settings, valve_lag_s);
  for (std::size_t k = 0; settings.slips() && k < settings.slip_radius_rad.size(); ++k)
    spring_.push_back({settings.slip_radius_rad[k], settings.slip_stiffness_nm_per_rad[k]});
  centre_.setZero(2, static_cast<Eigen::Index>(spring_.size()) * arm.size());
  if (learns_) {
    next_weight_ = hysteresis_.weights();
    hysteresis_.set_weights(next_weight_);
    slack_nm_.setZero(arm.dof(), next_weight_.size());
    mean_slack_nm_ = slack_nm_;
    mean_disturbance_nm_.setZero(arm.dof());
    double largest_nm = 0.0;
    for (const auto& segment : actuation.segments)
      for (const Chamber& chamber : segment) largest_nm += chamber.gain_nm_per_bar;
    least_power_nm2_ = std::pow(kLeastSlack * largest_nm * actuation.max_pressure_bar, 2);
  }
  for (const auto& segment : actuation.segments)
    chambers_.push_back(static_cast<int>(segment.size()));
  for (std::size_t j = 0; j < static_cast<std::size_t>(pressure_bar_.size()); ++j) {
    const FillVentLag lag = settings.lag(j, valve_lag_s);
    lag_.push_back(lag);
    approach_.push_back({approach(period_s, lag.fill_s), approach(period_s, lag.vent_s)});
  }
}

void ActuatorInverse::start() noexcept { learning_s_ = 0.0; }

void ActuatorInverse::reset() noexcept {
  pressure_bar_.setZero();
  if (hysteresis_.active()) hysteresis_.remember(pressure_bar_);
  acting_bar_ = pressure_bar_;
  if (hysteresis_.active()) hysteresis_.apply(acting_bar_);
}

void ActuatorInverse::advance(double passed_s, const PressureVector& set_point_bar) noexcept {
  for (Eigen::Index j = 0; j < pressure_bar_.size(); ++j)
    pressure_bar_[j] =
        lag_[static_cast<std::size_t>(j)].step(pressure_bar_[j], set_point_bar[j], passed_s);
  acting_bar_ = pressure_bar_;
  if (!hysteresis_.active()) return;
  hysteresis_.remember(pressure_bar_);
  hysteresis_.apply(acting_bar_);
}

/// From tau_A, A^-1 of what stiffening, for a linear actuator that is asked for p = y + T_0 y', and
/// slip oppose to the reference.
void ActuatorInverse::take_material(const Motion& motion, const PressureVector& asked_bar,
                                    VectorRef tau_nm) noexcept {
  const int width = arm_.segment_dof();
  force_nm_.setZero();
  Eigen::Index first = 0, centre = 0;
  for (int i = 0; i < arm_.size(); ++i) {
    const Eigen::Vector2d u = motion.reference_rad.segment<2>(width * i);
    const Eigen::Vector2d rate = motion.reference_velocity_radps.segment<2>(width * i);
    const Eigen::Index count = chambers_[static_cast<std::size_t>(i)];
    const double s =
        stiffening_per_bar_ * arm_.segments[static_cast<std::size_t>(i)].stiffness_nm_per_rad;
    Eigen::Vector2d force = s * (asked_bar.segment(first, count).sum() * u +
                                 target_lag_s_ * pressure_bar_.segment(first, count).sum() * rate);
    for (const SlipSpring& spring : spring_) {
      const Eigen::Vector2d from = centre_.col(centre++);
      force += spring.moment(from, u) + target_lag_s_ * (spring.slope(from, u) * rate);
    }
    force_nm_.segment<2>(width * i) = force;
    first += count;
  }
  solve_actuation(arm_, motion.u_rad, force_nm_, material_nm_);
  tau_nm -= material_nm_;
}

void ActuatorInverse::allocate(const PressureAllocator& allocator, ConstVectorRef tau_nm,
                               const Motion& motion, Allocation& out) noexcept {
  tau_nm_ = tau_nm;
  for (int step = 1;; ++step) {
    allocator.allocate(tau_nm_, out);
    for (Eigen::Index j = 0; j < pressure_bar_.size(); ++j)
      out.pressures_bar[j] = set_point(j, out.pressures_bar[j]);
    if (step == kSteps) return;
    effective_torque(allocator, out.pressures_bar, motion, effective_nm_);
    tau_nm_ += tau_nm - effective_nm_;
  }
}

/// Within the limits, in bar, for a linear actuator that is asked for so much.
double ActuatorInverse::set_point(Eigen::Index chamber, double asked_bar) const noexcept {
  const double acts = acting_bar_[chamber];
  double wanted = acts + target_approach_ * (asked_bar - acts);
  if (hysteresis_.active()) wanted = hysteresis_.pressure(chamber, wanted);
  const double from = pressure_bar_[chamber];
  const Approach& approach = approach_[static_cast<std::size_t>(chamber)];
  return std::clamp(from + (wanted - from) / approach.towards(wanted, from), min_bar_, max_bar_);
}

void ActuatorInverse::sent(const PressureAllocator& allocator, const PressureVector& set_point_bar,
                           const Motion& motion, VectorRef tau_nm) noexcept {
  effective_torque(allocator, set_point_bar, motion, tau_nm);
  Eigen::Index centre = 0;
  for (int i = 0; i < arm_.size(); ++i)
    for (const SlipSpring& spring : spring_) {
      const Eigen::Vector2d from = centre_.col(centre);
      centre_.col(centre++) =
          play(from, motion.reference_rad.segment<2>(arm_.segment_dof() * i), spring.radius_rad);
    }
}

void ActuatorInverse::effective_torque(const PressureAllocator& allocator,
                                       const PressureVector& set_point_bar, const Motion& motion,
                                       VectorRef tau_nm) noexcept {
  for (Eigen::Index j = 0; j < pressure_bar_.size(); ++j) {
    const double from = pressure_bar_[j];
    double acts = from + approach_[static_cast<std::size_t>(j)].towards(set_point_bar[j], from) *
                             (set_point_bar[j] - from);
    if (hysteresis_.active()) acts = hysteresis_.acting(j, acts);
    asked_bar_[j] = acting_bar_[j] + (acts - acting_bar_[j]) / target_approach_;
  }
  allocator.torque(asked_bar_, tau_nm);
  if (changes_torque_) take_material(motion, asked_bar_, tau_nm);
}

void ActuatorInverse::learn(const PressureAllocator& allocator, ConstVectorRef u_rad,
                            ConstVectorRef disturbance_nm, bool may) noexcept {
  if (!may || !disturbance_nm.allFinite()) return;
  learning_s_ += period_s_;
  const double forget = period_s_ / std::min(learning_s_, kForget_s);
  mean_disturbance_nm_ += forget * (disturbance_nm - mean_disturbance_nm_);
  double power_nm2 = 0.0;
  for (Eigen::Index k = 0; k < next_weight_.size(); ++k) {
    for (Eigen::Index j = 0; j < pressure_bar_.size(); ++j)
      asked_bar_[j] = hysteresis_.slack(k, j, pressure_bar_[j]);
    allocator.torque(asked_bar_, tau_nm_);
    apply_actuation(arm_, u_rad, tau_nm_, force_nm_);
    mean_slack_nm_.col(k) += forget * (force_nm_ - mean_slack_nm_.col(k));
    slack_nm_.col(k) = force_nm_ - mean_slack_nm_.col(k);
    power_nm2 += slack_nm_.col(k).squaredNorm();
  }
  power_nm2_ += forget * (power_nm2 - power_nm2_);
  if (learning_s_ < kForget_s) return;  // first the means
  const double rate = period_s_ / kLearning_s / (power_nm2_ + least_power_nm2_);
  double sum = 0.0;
  for (Eigen::Index k = 0; k < next_weight_.size(); ++k) {
    const double along = slack_nm_.col(k).dot(disturbance_nm - mean_disturbance_nm_);
    const double moved = next_weight_[k] + rate * along;
    next_weight_[k] = std::clamp(moved, 0.0, kMostLearnt);
    sum += next_weight_[k];
  }
  if (sum > kMostLearnt) next_weight_ *= kMostLearnt / sum;
  hysteresis_.set_weights(next_weight_);
}

}  // namespace softarm
