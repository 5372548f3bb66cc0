#include "softarm/runtime/following.hpp"

#include <algorithm>
#include <cmath>

#include "softarm/base/time.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/statics.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {

PressureWatch::PressureWatch(const SafetySettings& settings, int chambers) noexcept
    : tolerance_bar_(settings.pressure_tolerance_bar),
      settling_ns_(to_ns(settings.pressure_settling_s)) {
  for (PressureVector* bound : {&now_.low, &now_.high, &before_.low, &before_.high})
    bound->setZero(chambers);
}

void PressureWatch::command(std::int64_t now_ns, const PressureVector& commanded_bar) noexcept {
  if (known_ == 0 || now_ns - since_ns_ >= settling_ns_) {
    before_ = now_;
    known_ = std::min(known_ + 1, 2);
    now_ = {commanded_bar, commanded_bar};
    since_ns_ = now_ns;
    return;
  }
  now_.low = now_.low.cwiseMin(commanded_bar);
  now_.high = now_.high.cwiseMax(commanded_bar);
}

void PressureWatch::measure(const PressureVector& measured_bar) noexcept {
  if (tolerance_bar_ <= 0.0 || known_ < 2) return;
  bool outside = false;
  for (Eigen::Index j = 0; j < measured_bar.size(); ++j) {
    const double low = std::min(now_.low[j], before_.low[j]) - tolerance_bar_;
    const double high = std::max(now_.high[j], before_.high[j]) + tolerance_bar_;
    outside |= !(measured_bar[j] >= low && measured_bar[j] <= high);
  }
  in_row_ = outside ? std::min(in_row_ + 1, kInRow) : 0;
}

void PressureWatch::reset() noexcept { known_ = in_row_ = 0; }

CurvatureWatch::CurvatureWatch(const SafetySettings& settings, const ArmParameters& arm)
    : limit_nm_(settings.curvature_residual_nm),
      settling_ns_(to_ns(settings.curvature_settling_s)),
      arm_(arm),
      workspace_(arm) {
  for (SegmentVector* v : {&force_, &actuated_}) v->setZero(arm.dof());
}

void CurvatureWatch::judge(std::int64_t now_ns, ConstVectorRef u_rad,
                           ConstVectorRef tau_actuation_nm) noexcept {
  if (largest_residual_nm(u_rad, tau_actuation_nm) <= limit_nm_) {
    reset();
  } else if (!beyond_) {
    beyond_ = true;
    since_ns_ = now_ns;
  }
  strays_ = beyond_ && now_ns - since_ns_ >= settling_ns_;
}

double CurvatureWatch::largest_residual_nm(ConstVectorRef u_rad,
                                           ConstVectorRef tau_actuation_nm) noexcept {
  static_moments(arm_, workspace_, u_rad, force_);
  apply_actuation(arm_, u_rad, tau_actuation_nm, actuated_);
  double largest = 0.0;
  for (Eigen::Index i = 0; i < force_.size(); i += 2)
    largest = std::max(largest, (force_.segment<2>(i) - actuated_.segment<2>(i)).norm());
  return largest;
}

LengthWatch::LengthWatch(const SafetySettings& settings, const ArmParameters& arm)
    : settling_ns_(to_ns(settings.length_settling_s)),
      warning_{.relative = settings.length_warning},
      fault_{.relative = settings.length_fault} {
  for (const SegmentParameters& segment : arm.segments) length_m_.push_back(segment.length_m);
  reset();
}

void LengthWatch::reset() noexcept {
  for (Limit* limit : {&warning_, &fault_}) {
    limit->since_ns.fill(kNever);
    limit->exceeded = limit->beyond = false;
  }
}

void LengthWatch::judge(std::int64_t capture_ns, const CurvatureEstimate& estimate) noexcept {
  judge(capture_ns, estimate, warning_);
  judge(capture_ns, estimate, fault_);
}

void LengthWatch::judge(std::int64_t capture_ns, const CurvatureEstimate& estimate,
                        Limit& limit) noexcept {
  if (limit.relative <= 0.0) return;
  limit.exceeded = limit.beyond = false;
  for (std::size_t i = 0; i < length_m_.size(); ++i) {
    const double allowed_m = limit.relative * length_m_[i];
    const bool evident =
        estimate.valid[i] && 3.0 * std::sqrt(estimate.length_variance_m2[i]) <= allowed_m;
    std::int64_t& since_ns = limit.since_ns[i];
    if (evident) {
      const bool off = std::abs(estimate.length_m[i] - length_m_[i]) > allowed_m;
      since_ns = !off ? kNever : since_ns == kNever ? capture_ns : since_ns;
    }
    limit.beyond |= since_ns != kNever;
    limit.exceeded |= since_ns != kNever && capture_ns - since_ns >= settling_ns_;
  }
}

}  // namespace softarm
