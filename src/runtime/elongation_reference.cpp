#include "softarm/runtime/elongation_reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "softarm/actuation/input_map.hpp"
#include "softarm/model/statics.hpp"

namespace softarm {

namespace {

/// N, of this pressure in all chambers of a segment.
double axial_force_n(const ActuationSettings& actuation, std::size_t segment, double pressure_bar) {
  return pressure_bar * axial_input_map(actuation.kind, actuation.segments[segment]).sum();
}

SegmentCorrection of(const ModelCorrection* correction, int segment) {
  return correction == nullptr ? SegmentCorrection{}
                               : correction->segment[static_cast<std::size_t>(segment)];
}

}  // namespace

SegmentScalars straight_elongation(const ArmParameters& arm, const ActuationSettings& actuation,
                                   double pressure_bar) {
  const int n = arm.size();
  SegmentScalars out = SegmentScalars::Zero(n);
  DynamicsWorkspace workspace(arm);
  Eigen::VectorXd gravity(arm.dof());
  // Straight, e has no influence on the axial weight.
  gravity_moments(arm, workspace, Eigen::VectorXd::Zero(arm.dof()), gravity);
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const SegmentParameters& segment = arm.segments[k];
    if (segment.constant_length) continue;
    if (!(segment.axial_stiffness_n_per_m > 0.0) || !(segment.axial_damping_ns_per_m > 0.0)) {
      throw std::invalid_argument(fmt::format(
          "arm: expected an axial stiffness and damping > 0 of segment {}, which stretches, got {} "
          "and {}",
          i + 1, segment.axial_stiffness_n_per_m, segment.axial_damping_ns_per_m));
    }
    const double force_n = axial_force_n(actuation, k, pressure_bar);
    out[i] = (force_n - gravity[3 * i + 2]) / segment.axial_stiffness_n_per_m;
  }
  return out;
}

ElongationReference::ElongationReference(const ArmParameters& arm,
                                         const ActuationSettings& actuation,
                                         const PressureAllocator& allocator)
    : arm_(arm), allocator_(allocator), workspace_(arm), horizontal_(arm) {
  for (SegmentScalars* v : {&e_, &rate_, &acceleration_, &jerk_, &force_, &force_before_,
                            &force_after_, &follows_, &stiffness_, &damping_, &carried_kg_})
    v->setZero(arm.size());
  for (SegmentVector* v : {&tau_, &along_x_, &along_y_}) v->setZero(arm.dof());
  bias_n_.setZero(arm.size());
  for (int i = 0; i < arm.size(); ++i)
    bias_n_[i] = axial_force_n(actuation, static_cast<std::size_t>(i), actuation.bias_pressure_bar);
  Eigen::MatrixXd inertia(arm.dof(), arm.dof());
  inertia_matrix(arm_, workspace_, Eigen::VectorXd::Zero(arm.dof()), inertia);
  for (int i = 0; i < arm.size(); ++i)
    for (int j = 0; j < arm.size(); ++j) carried_kg_[i] += inertia(3 * i + 2, 3 * j + 2);
}

void ElongationReference::start(double time_s, ConstVectorRef q) noexcept {
  time_s_ = time_s;
  for (int i = 0; i < arm_.size(); ++i) e_[i] = q[3 * i + 2];
  for (SegmentScalars* v : {&rate_, &acceleration_, &jerk_}) v->setZero();
}

void ElongationReference::replace(double time_s, ReferenceSample& sample) const noexcept {
  const double ahead = time_s - time_s_;
  for (int i = 0; i < arm_.size(); ++i) {
    const double gained = ahead * jerk_[i];
    sample.u[3 * i + 2] =
        e_[i] + ahead * (rate_[i] + ahead * (acceleration_[i] / 2.0 + gained / 6.0));
    sample.velocity[3 * i + 2] = rate_[i] + ahead * (acceleration_[i] + 0.5 * gained);
    sample.acceleration[3 * i + 2] = acceleration_[i] + gained;
  }
}

// force_ = N - I of the sample; where `exact`, also how far N follows what is asked of it.
void ElongationReference::force_beside_spring(double time_s, const ReferenceSample& sample,
                                              const ModelCorrection* correction, bool forces,
                                              bool exact) noexcept {
  sample_.u = sample.u;
  sample_.velocity = sample.velocity;
  sample_.acceleration = sample.acceleration;
  replace(time_s, sample_);
  // Not that of the sample's time: the difference between samples would go round in a circle.
  for (int i = 0; i < arm_.size(); ++i) sample_.acceleration[3 * i + 2] = acceleration_[i];
  inverse_dynamics(arm_, workspace_, sample_.u, sample_.velocity, sample_.velocity,
                   sample_.acceleration, {}, tau_);
  if (correction != nullptr) horizontal_.rows(sample_.u, workspace_, along_x_, along_y_);
  for (int i = 0; i < arm_.size(); ++i) {
    const SegmentParameters& segment = arm_.segments[static_cast<std::size_t>(i)];
    const SegmentCorrection off = of(correction, i);
    Eigen::Vector2d bend =
        tau_.segment<2>(3 * i) +
        (1.0 + off.stiffness) * segment.stiffness_nm_per_rad * sample.u.segment<2>(3 * i) +
        (1.0 + off.damping) * segment.damping_nms_per_rad * sample.velocity.segment<2>(3 * i);
    if (correction != nullptr) {
      bend += off.load.x() * along_x_.segment<2>(3 * i) + off.load.y() * along_y_.segment<2>(3 * i);
      if (forces) bend -= correction->disturbance_nm.segment<2>(2 * i);
      bend /= 1.0 + off.gain;
    }
    const double beside_n = tau_[3 * i + 2], unknown_n = forces ? off.axial_force_n : 0.0;
    const double wanted_n =
        beside_n + stiffness_[i] * sample.u[3 * i + 2] + damping_[i] * sample.velocity[3 * i + 2];
    // tau_A = A_chamber^-1 bend
    const AxialChamberMap& chambers = allocator_.axial(i);
    const AxialChamberMap::Torque moment{-bend.y(), bend.x()};
    const double asked_n = (wanted_n - unknown_n) / (1.0 + off.axial_gain);
    const double chambers_n = chambers.within_reach(moment, asked_n);
    if (exact) {
      const double step_n = chambers.smoothing_n();
      follows_[i] = (chambers.within_reach(moment, asked_n + step_n) - chambers_n) / step_n;
    }
    force_[i] = (1.0 + off.axial_gain) * chambers_n + unknown_n - beside_n;
  }
}

void ElongationReference::hold_constant_lengths(SegmentVector& tau_actuation_nm) const noexcept {
  for (int i = 0; i < arm_.size(); ++i)
    if (arm_.segments[static_cast<std::size_t>(i)].constant_length)
      tau_actuation_nm[3 * i + 2] = bias_n_[i];
}

void ElongationReference::advance(double time_s, double lookahead_s, ReferenceWindow& window,
                                  const ModelCorrection* correction, bool forces) noexcept {
  for (int i = 0; i < arm_.size(); ++i) {
    const SegmentParameters& segment = arm_.segments[static_cast<std::size_t>(i)];
    const SegmentCorrection off = of(correction, i);
    stiffness_[i] = (1.0 + off.axial_stiffness) * segment.axial_stiffness_n_per_m;
    damping_[i] = (1.0 + off.axial_damping) * segment.axial_damping_ns_per_m;
  }
  const double passed_s = std::max(time_s - time_s_, 0.0);
  const double after_s = time_s + lookahead_s, before_s = after_s - window.interval_s;
  force_beside_spring(before_s, window.before, correction, forces);
  force_before_ = force_;
  force_beside_spring(after_s, window.after, correction, forces);
  force_after_ = force_;
  force_beside_spring(time_s, window.now, correction, forces, true);
  for (int i = 0; i < arm_.size(); ++i) {
    const SegmentParameters& segment = arm_.segments[static_cast<std::size_t>(i)];
    if (segment.constant_length) continue;
    const double stiffness = stiffness_[i], damping = damping_[i];
    const double slope = (force_after_[i] - force_before_[i]) / window.interval_s;
    // Exact for a force that rises evenly.
    const double decay = std::exp(-passed_s * stiffness / damping);
    const double lag_s = damping / stiffness;
    const double now = (force_[i] - slope * lag_s) / stiffness;  // where the ramp's answer is
    const double then = now - slope * passed_s / stiffness;      // and was
    e_[i] = now + decay * (e_[i] - then);
    rate_[i] = (force_[i] - stiffness * e_[i]) / damping;
    // Without inertia along e, which the chambers overcome where they give what is asked of them;
    // where they do not, e'' lags by it (backward Euler).
    const double light = (slope - stiffness * rate_[i]) / damping;
    const double inertia_s = (1.0 - follows_[i]) * carried_kg_[i] / damping;
    const double before = acceleration_[i];
    acceleration_[i] =
        passed_s > 0.0 ? light + inertia_s / (inertia_s + passed_s) * (before - light) : light;
    jerk_[i] = passed_s > 0.0 ? (acceleration_[i] - before) / passed_s : 0.0;
  }
  time_s_ = time_s;
  replace(before_s, window.before);
  replace(time_s, window.now);
  replace(after_s, window.after);
}

}  // namespace softarm
