#include "softarm/control/repetition.hpp"

#include <algorithm>
#include <cmath>

namespace softarm {
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
}

RepetitiveCompensation::Place RepetitiveCompensation::place(double time_s) const noexcept {
  const double periods = time_s / period_s_;
  const double at = kNodes * (periods - std::floor(periods));
  const int before = std::min(static_cast<int>(at), kNodes - 1);
  return {before, (before + 1) % kNodes, at - before};
}

/// The table at `time_s` follows what became of d since then.
void RepetitiveCompensation::follow(double time_s) noexcept {
  target_ = now_ - seen_.col(next_);
  const Place then = place(time_s);
  // Two parts of kNodes pass a node, with half the weight on the average.
  const double passed = std::min(1.0, kGain * kNodes * step_s_ / period_s_);
  table_.col(then.before) += passed * (1.0 - then.part) * (target_ - table_.col(then.before));
  table_.col(then.after) += passed * then.part * (target_ - table_.col(then.after));
}

void RepetitiveCompensation::advance(double time_s, bool learn, ModelCorrection& found) noexcept {
  if (!(period_s_ > 0.0)) return;
  const int width = stretches_ ? 3 : 2;
  for (int i = 0; i < segments_; ++i) {
    now_.segment<2>(width * i) = found.disturbance_nm.segment<2>(2 * i);
    if (stretches_) now_[3 * i + 2] = found.segment[static_cast<std::size_t>(i)].axial_force_n;
  }
  const double then_s = time_s - static_cast<double>(ticks_) * step_s_;
  if (learn && in_row_ == ticks_ && then_s >= period_s_) follow(then_s);
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
