// The offset that joins a reference from wherever the arm is.
#pragma once

#include <algorithm>
#include <cmath>

#include "softarm/control/reference.hpp"

namespace softarm {

/// Of a minimum-jerk (quintic) motion over its mean speed.
inline constexpr double kQuinticPeakSpeed = 1.875;

/// d(t) = (1 - x)^3 (a + b x + c x^2), x = (t - begin) / duration: given d, d', d'' at x = 0; zero
/// with its first two derivatives at x = 1 and after.
class Blend {
 public:
  void resize(int dof) {
    a_.setZero(dof);
    b_.setZero(dof);
    c_.setZero(dof);
  }

  void clear() noexcept { begin_s_ = duration_s_ = 0.0; }

  /// offset, velocity, acceleration: 2n each at begin_s. An offset too small to matter is left out,
  /// so that a reference that is joined where it stands is followed exactly.
  void set(double begin_s, double duration_s, const SegmentVector& offset,
           const SegmentVector& velocity, const SegmentVector& acceleration) noexcept {
    constexpr double kNothing = 1e-9;
    if (offset.lpNorm<Eigen::Infinity>() < kNothing &&
        velocity.lpNorm<Eigen::Infinity>() < kNothing &&
        acceleration.lpNorm<Eigen::Infinity>() < kNothing) {
      clear();
      return;
    }
    begin_s_ = begin_s;
    duration_s_ = duration_s;
    a_ = offset;
    b_ = duration_s * velocity + 3.0 * a_;
    c_ = 0.5 * duration_s * duration_s * acceleration + 3.0 * (b_ - a_);
  }

  bool active(double time_s) const noexcept { return time_s < begin_s_ + duration_s_; }
  double remaining_s(double time_s) const noexcept {
    return std::max(begin_s_ + duration_s_ - time_s, 0.0);
  }

  /// Adds d, d', d'' to the sample; before the beginning, what they are at the beginning.
  void add(double time_s, ReferenceSample& sample) const noexcept {
    if (!active(time_s) || duration_s_ == 0.0) return;
    const double x = std::max(time_s - begin_s_, 0.0) / duration_s_, y = 1.0 - x;
    const double rate = 1.0 / duration_s_;
    for (Eigen::Index i = 0; i < a_.size(); ++i) {
      const double p = a_[i] + x * (b_[i] + x * c_[i]);
      const double dp = b_[i] + 2.0 * x * c_[i];
      sample.u[i] += y * y * y * p;
      sample.velocity[i] += rate * y * y * (y * dp - 3.0 * p);
      sample.acceleration[i] += rate * rate * y * (6.0 * p - 6.0 * y * dp + 2.0 * y * y * c_[i]);
    }
  }

 private:
  double begin_s_ = 0.0;
  double duration_s_ = 0.0;
  SegmentVector a_, b_, c_;
};

}  // namespace softarm
