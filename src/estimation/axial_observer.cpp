#include "estimation/axial_observer.hpp"

#include <algorithm>
#include <cmath>

#include "estimation/correction_limits.hpp"
#include "softarm/base/time.hpp"

namespace softarm {
namespace {

constexpr double kStep_s = 2.5e-3;
/// Lengths, however exact, are not trusted further: an arm is not quite PCC.
constexpr double kLeastNoise_m = 2e-5;
/// Of the scale, when it starts.
constexpr double kFirstForce = 0.1;

/// Of every segment that stretches, an axial force that counts, N: what bends a section by one rad,
/// as a force along it, sqrt(k k_a).
SegmentVector force_scale(const ArmParameters& arm) {
  SegmentVector scale(arm.size());
  for (int i = 0; i < arm.size(); ++i) {
    const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
    scale[i] = std::max(1e-3 * segment.axial_stiffness_n_per_m,
                        std::sqrt(segment.stiffness_nm_per_rad * segment.axial_stiffness_n_per_m));
  }
  return scale;
}

}  // namespace

AxialObserver::AxialObserver(const ArmParameters& arm, const ModelObserverSettings& settings,
                             int commands, double lag_s)
    : arm_(arm),
      settings_(settings),
      bends_(at_rest_length(arm)),
      workspace_(arm),
      bends_workspace_(bends_),
      history_(arm.size(), commands, lag_s),
      scale_n_(force_scale(arm)),
      monitor_(scale_n_, settings.disturbance_drift_per_sqrt_s,
               settings.largest_disturbance_drift_per_sqrt_s) {
  for (SegmentScalars* each : {&now_.e_m, &ahead_.e_m, &beside_n_, &reference_n_})
    each->setZero(arm.size());
  for (SegmentVector* each : {&q_, &velocity_, &acceleration_, &force_}) each->setZero(arm.dof());
  for (SegmentVector* each : {&mean_force_, &forces_}) each->setZero(arm.size());
  for (SegmentVector* each : {&coupling_nm_, &bends_force_}) each->setZero(bends_.dof());
  for (State& error : error_) error.setZero();
  history_.settle(0, now_.force);
  forget_parameters();
}

void AxialObserver::command(std::int64_t from_ns, ConstVectorRef tau_actuation) noexcept {
  for (int i = 0; i < arm_.size(); ++i) forces_[i] = tau_actuation[3 * i + 2];
  history_.command(from_ns, forces_);
}

void AxialObserver::forget_parameters() noexcept {
  const double sigma = settings_.learn_parameters ? settings_.parameter_deviation : 0.0;
  for (std::size_t i = 0; i < P_.size(); ++i) {
    error_[i].setZero();
    P_[i].setZero();
    P_[i].diagonal().tail<3>().setConstant(sigma * sigma);
  }
}

void AxialObserver::start(std::int64_t capture_ns, const CurvatureEstimate& estimate) noexcept {
  history_.settle(capture_ns, now_.force);
  monitor_.reset();
  beside_n_.setZero(arm_.size());
  coupling_nm_.setZero(bends_.dof());
  for (int i = 0; i < arm_.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const bool stretches = !arm_.segments[k].constant_length;
    now_.e_m[i] = stretches ? estimate.length_m[k] - arm_.segments[k].length_m : 0.0;
    const double force_n = kFirstForce * scale_n_[i];
    error_[k][1] = 0.0;
    P_[k].topRows<2>().setZero();
    P_[k].leftCols<2>().setZero();
    P_[k](0, 0) = estimate.length_variance_m2[k] + kLeastNoise_m * kLeastNoise_m;
    P_[k](1, 1) = force_n * force_n;
  }
}

double AxialObserver::push_n(std::size_t i, double force_n) const noexcept {
  return (1.0 + error_[i][4]) * force_n + error_[i][1] - beside_n_[static_cast<Eigen::Index>(i)];
}
double AxialObserver::stiffness(std::size_t i) const noexcept {
  return (1.0 + error_[i][2]) * arm_.segments[i].axial_stiffness_n_per_m;
}
double AxialObserver::damping(std::size_t i) const noexcept {
  return (1.0 + error_[i][3]) * arm_.segments[i].axial_damping_ns_per_m;
}
double AxialObserver::rate_mps(std::size_t i, const Motion& motion) const noexcept {
  if (arm_.segments[i].constant_length) return 0.0;
  const auto k = static_cast<Eigen::Index>(i);
  return (push_n(i, motion.force.tau_nm[k]) - stiffness(i) * motion.e_m[k]) / damping(i);
}

/// Exact for a force that is constant within a step.
void AxialObserver::advance(std::int64_t time_ns, Motion& motion) noexcept {
  const std::int64_t begin_ns = motion.force.time_ns, gap_ns = time_ns - begin_ns;
  if (gap_ns <= 0) return;
  const auto steps = static_cast<std::int64_t>(std::ceil(to_seconds(gap_ns) / kStep_s - 1e-6));
  for (std::int64_t s = 1; s <= steps; ++s) {
    const std::int64_t from_ns = motion.force.time_ns, to_ns = begin_ns + gap_ns * s / steps;
    history_.advance(to_ns, motion.force, mean_force_);
    for (int i = 0; i < arm_.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (arm_.segments[k].constant_length) continue;
      const double rests_m = push_n(k, mean_force_[i]) / stiffness(k);
      const double gone = -std::expm1(-to_seconds(to_ns - from_ns) * stiffness(k) / damping(k));
      motion.e_m[i] += gone * (rests_m - motion.e_m[i]);
    }
  }
}

void AxialObserver::propagate(double step_s, const KnownMotion* reference) noexcept {
  for (int i = 0; i < arm_.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const SegmentParameters& segment = arm_.segments[k];
    if (segment.constant_length) continue;
    const double gone = -std::expm1(-step_s * stiffness(k) / damping(k));
    const double by_force = gone / stiffness(k);  // of e, by a force that is constant
    // The parameters' columns are those of the reference: at the estimate, their noise would be
    // correlated with the innovation.
    Covariance F = Covariance::Identity();
    F(0, 0) = 1.0 - gone;
    F(0, 1) = by_force;
    if (reference != nullptr) {
      F(0, 2) = -by_force * segment.axial_stiffness_n_per_m * reference->u_rad[3 * i + 2];
      F(0, 3) = -by_force * segment.axial_damping_ns_per_m * reference->velocity_radps[3 * i + 2];
      F(0, 4) = by_force * reference_n_[i];
    }
    P_[k] = (F * P_[k] * F.transpose()).eval();
    P_[k](1, 1) += monitor_.drift_per_s() * step_s * scale_n_[i] * scale_n_[i];
  }
}

bool AxialObserver::advance(std::int64_t time_ns, ConstVectorRef u_rad,
                            ConstVectorRef velocity_radps, const KnownMotion* reference) noexcept {
  const double step_s = to_seconds(time_ns - now_.force.time_ns);
  if (step_s <= 0.0) return true;
  const auto row = [&](const SegmentVector& q, const SegmentVector& v, const SegmentVector& a,
                       SegmentScalars& out) {
    inverse_dynamics(arm_, workspace_, q, v, v, a, {}, force_);
    for (int i = 0; i < arm_.size(); ++i) out[i] = force_[3 * i + 2];
  };
  acceleration_.setZero();
  if (reference != nullptr) {
    acceleration_ = reference->acceleration_radps2;
    row(reference->u_rad, reference->velocity_radps, acceleration_, reference_n_);
    for (int i = 0; i < arm_.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      reference_n_[i] = (reference_n_[i] + stiffness(k) * reference->u_rad[3 * i + 2] +
                         damping(k) * reference->velocity_radps[3 * i + 2] - error_[k][1]) /
                        (1.0 + error_[k][4]);
    }
  }
  propagate(step_s, reference);
  advance(time_ns, now_);
  for (int i = 0; i < arm_.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    q_.segment<3>(3 * i) << u_rad.segment<2>(2 * i), now_.e_m[i];
    velocity_.segment<3>(3 * i) << velocity_radps.segment<2>(2 * i), rate_mps(k, now_);
  }
  row(q_, velocity_, acceleration_, beside_n_);
  const SegmentScalars present_m = lengths(arm_) + now_.e_m;
  set_lengths(bends_, present_m);
  coupling_nm_ = bend_part(arm_, force_);
  inverse_dynamics(bends_, bends_workspace_, u_rad, velocity_radps, velocity_radps,
                   bend_part(arm_, acceleration_), {}, bends_force_);
  coupling_nm_ -= bends_force_;
  return now_.e_m.allFinite() && beside_n_.allFinite();
}

bool AxialObserver::correct(const CurvatureEstimate& estimate, double since_s,
                            bool learn) noexcept {
  double square = 0.0;
  int seen = 0;
  at_limit_ = false;
  for (int i = 0; i < arm_.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double variance_m2 = estimate.length_variance_m2[k] + kLeastNoise_m * kLeastNoise_m;
    if (arm_.segments[k].constant_length || !estimate.valid[k] || !std::isfinite(variance_m2))
      continue;
    const double innovation_m = estimate.length_m[k] - arm_.segments[k].length_m - now_.e_m[i];
    const double all_m2 = P_[k](0, 0) + variance_m2;
    square += innovation_m * innovation_m / all_m2;
    ++seen;
    State gain = P_[k].col(0) / all_m2;
    // Uncertain all the same (Schmidt's filter); Joseph's form, which any gain may have.
    if (!learn || monitor_.jump()) gain.tail<3>().setZero();
    Covariance kept = Covariance::Identity();
    kept.col(0) -= gain;
    P_[k] = (kept * P_[k] * kept.transpose() + variance_m2 * gain * gain.transpose()).eval();
    now_.e_m[i] += gain[0] * innovation_m;
    error_[k].tail<4>() += innovation_m * gain.tail<4>();
    for (Eigen::Index j = 2; j < kStates; ++j) at_limit_ |= limit_correction(error_[k][j]);
  }
  if (seen == 0) return true;
  for (int i = 0; i < arm_.size(); ++i) forces_[i] = error_[static_cast<std::size_t>(i)][1];
  monitor_.add(square / seen, forces_, since_s);
  return now_.e_m.allFinite() && forces_.allFinite();
}

void AxialObserver::predict(std::int64_t time_ns, SegmentScalars& e_m,
                            SegmentScalars& rates_mps) noexcept {
  ahead_ = now_;
  advance(time_ns, ahead_);
  e_m = ahead_.e_m;
  rates_mps.resize(arm_.size());
  for (int i = 0; i < arm_.size(); ++i)
    rates_mps[i] = rate_mps(static_cast<std::size_t>(i), ahead_);
}

void AxialObserver::put(ModelCorrection& correction) const noexcept {
  for (std::size_t i = 0; i < arm_.segments.size(); ++i) {
    SegmentCorrection& out = correction.segment[i];
    out.axial_force_n = error_[i][1];
    out.axial_stiffness = error_[i][2];
    out.axial_damping = error_[i][3];
    out.axial_gain = error_[i][4];
  }
}

void AxialObserver::put_deviation(ModelCorrection& deviation) const noexcept {
  for (std::size_t i = 0; i < arm_.segments.size(); ++i) {
    SegmentCorrection& out = deviation.segment[i];
    const State variance = P_[i].diagonal().cwiseMax(0.0);
    out.axial_force_n = std::sqrt(variance[1]);
    out.axial_stiffness = std::sqrt(variance[2]);
    out.axial_damping = std::sqrt(variance[3]);
    out.axial_gain = std::sqrt(variance[4]);
  }
}

void AxialObserver::put_elongation(SegmentScalars& e_m,
                                   SegmentScalars& deviation_m) const noexcept {
  e_m = now_.e_m;
  deviation_m.resize(arm_.size());
  for (Eigen::Index i = 0; i < arm_.size(); ++i)
    deviation_m[i] = std::sqrt(std::max(0.0, P_[static_cast<std::size_t>(i)](0, 0)));
}

}  // namespace softarm
