#include "softarm/control/repetition.hpp"

#include <algorithm>
#include <cmath>

namespace softarm {
namespace {

/// Largest difference of any parameter; disturbances and forces are none.
double largest_change(const SegmentCorrection& a, const SegmentCorrection& b) noexcept {
  return std::max({std::abs(a.stiffness - b.stiffness), std::abs(a.damping - b.damping),
                   std::abs(a.gain - b.gain), (a.load - b.load).cwiseAbs().maxCoeff(),
                   std::abs(a.axial_stiffness - b.axial_stiffness),
                   std::abs(a.axial_damping - b.axial_damping),
                   std::abs(a.axial_gain - b.axial_gain)});
}

}  // namespace

RepetitiveCompensation::RepetitiveCompensation(const ArmParameters& arm, double lead_s,
                                               double step_s)
    : step_s_(step_s),
      ticks_(std::max<Eigen::Index>(1, std::llround(lead_s / step_s))),
      stretches_(arm.extensible),
      segments_(arm.size()),
      largest_(SegmentVector::Zero(arm.dof())),
      now_(largest_),
      target_(largest_),
      table_(Eigen::MatrixXd::Zero(arm.dof(), kNodes)),
      seen_(Eigen::MatrixXd::Zero(arm.dof(), ticks_)) {
  const int width = arm.segment_dof();
  for (int i = 0; i < segments_; ++i) {
    const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
    const double k = segment.stiffness_nm_per_rad;
    largest_.segment<2>(width * i).setConstant(kLargest * k);
    if (stretches_) largest_[3 * i + 2] = kLargest * std::sqrt(k * segment.axial_stiffness_n_per_m);
  }
}

void RepetitiveCompensation::start(double period_s) noexcept {
  period_s_ = period_s;
  table_.setZero();
  in_row_ = 0;
  looked_ = settled_ = false;
}

RepetitiveCompensation::Place RepetitiveCompensation::place(double time_s) const noexcept {
  const double periods = time_s / period_s_;
  const double at = kNodes * (periods - std::floor(periods));
  const int before = std::min(static_cast<int>(at), kNodes - 1);
  return {before, (before + 1) % kNodes, at - before};
}

void RepetitiveCompensation::judge(double time_s, const ModelCorrection& found) noexcept {
  if (looked_ && time_s < looked_s_ + std::max(period_s_, kSettling_s)) return;
  double change = 0.0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(segments_); ++i) {
    change = std::max(change, largest_change(found.segment[i], earlier_.segment[i]));
    earlier_.segment[i] = found.segment[i];
  }
  settled_ = looked_ && change <= kSettled;
  looked_ = true;
  looked_s_ = time_s;
}

/// The table at `time_s` follows what became of d since then.
void RepetitiveCompensation::follow(double time_s) noexcept {
  if (settled_) {
    target_ = now_ - seen_.col(next_);
  } else {
    target_.setZero();
  }
  const Place then = place(time_s);
  // Two parts of kNodes pass a node, with half the weight on the average.
  const double passed = std::min(1.0, kGain * kNodes * step_s_ / period_s_);
  table_.col(then.before) += passed * (1.0 - then.part) * (target_ - table_.col(then.before));
  table_.col(then.after) += passed * then.part * (target_ - table_.col(then.after));
}

void RepetitiveCompensation::advance(double time_s, bool learn, ModelCorrection& found) noexcept {
  if (!(period_s_ > 0.0)) return;
  judge(time_s, found);
  const int width = stretches_ ? 3 : 2;
  for (int i = 0; i < segments_; ++i) {
    now_.segment<2>(width * i) = found.disturbance_nm.segment<2>(2 * i);
    if (stretches_) now_[3 * i + 2] = found.segment[static_cast<std::size_t>(i)].axial_force_n;
  }
  if (learn && in_row_ == ticks_) follow(time_s - static_cast<double>(ticks_) * step_s_);
  in_row_ = learn ? std::min(in_row_ + 1, ticks_) : 0;
  seen_.col(next_) = now_;
  next_ = (next_ + 1) % ticks_;

  const Place at = place(time_s);
  target_ = ((1.0 - at.part) * table_.col(at.before) + at.part * table_.col(at.after))
                .cwiseMax(-largest_)
                .cwiseMin(largest_);
  for (int i = 0; i < segments_; ++i) {
    found.disturbance_nm.segment<2>(2 * i) += target_.segment<2>(width * i);
    if (stretches_) found.segment[static_cast<std::size_t>(i)].axial_force_n += target_[3 * i + 2];
  }
}

}  // namespace softarm
