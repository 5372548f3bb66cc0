#include "softarm/runtime/following.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "softarm/base/time.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/statics.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {
namespace {

/// A movement of the commanded pressures that must show in the poses.
constexpr double kNoticeable_bar = 0.03;

/// Least frames and declared periods of an interval, and how much faster than declared is too fast.
constexpr int kFrames = 40;
constexpr int kPeriods = 20;
constexpr int kFaster = 3;

}  // namespace

PressureWatch::PressureWatch(const SafetySettings& settings, int chambers) noexcept
    : tolerance_bar_(settings.pressure_tolerance_bar),
      settling_ns_(to_ns(settings.pressure_settling_s)) {
  for (PressureVector* bound :
       {&now_.low, &now_.high, &before_.low, &before_.high, &since_change_.low, &since_change_.high,
        &commanded_bar_, &measured_bar_})
    bound->setZero(chambers);
  moved_ns_.assign(static_cast<std::size_t>(chambers), kNever);
}

void PressureWatch::command(std::int64_t now_ns, const PressureVector& commanded_bar) noexcept {
  now_ns_ = now_ns;
  commanded_bar_ = commanded_bar;
  since_change_.low = since_change_.low.cwiseMin(commanded_bar);
  since_change_.high = since_change_.high.cwiseMax(commanded_bar);
  for (Eigen::Index j = 0; j < commanded_bar.size(); ++j) {
    std::int64_t& moved_ns = moved_ns_[static_cast<std::size_t>(j)];
    const bool wide = since_change_.high[j] - since_change_.low[j] > 0.5 * tolerance_bar_;
    if (wide && moved_ns == kNever) moved_ns = now_ns;
  }
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
  if (tolerance_bar_ <= 0.0) return;
  judge_repeats(measured_bar);
  if (known_ < 2) return;
  bool outside = false;
  for (Eigen::Index j = 0; j < measured_bar.size(); ++j) {
    const double low = std::min(now_.low[j], before_.low[j]) - tolerance_bar_;
    const double high = std::max(now_.high[j], before_.high[j]) + tolerance_bar_;
    outside |= !(measured_bar[j] >= low && measured_bar[j] <= high);
  }
  in_row_ = outside ? std::min(in_row_ + 1, kInRow) : 0;
}

void PressureWatch::judge_repeats(const PressureVector& measured_bar) noexcept {
  stale_ = false;
  // A vented valve may measure the same zero for ever.
  const auto rests_at_zero = [&](Eigen::Index j) {
    return known_ == 2 && std::max(now_.high[j], before_.high[j]) <= 0.0 &&
           std::min(now_.low[j], before_.low[j]) >= 0.0 &&
           std::abs(measured_bar[j]) <= tolerance_bar_;
  };
  for (Eigen::Index j = 0; j < measured_bar.size(); ++j) {
    std::int64_t& moved_ns = moved_ns_[static_cast<std::size_t>(j)];
    const bool repeats = measured_ && measured_bar[j] == measured_bar_[j];
    if (repeats && !rests_at_zero(j)) {
      stale_ |= moved_ns != kNever && now_ns_ - moved_ns >= settling_ns_;
      continue;
    }
    since_change_.low[j] = since_change_.high[j] = commanded_bar_[j];
    moved_ns = kNever;
  }
  measured_bar_ = measured_bar;
  measured_ = true;
}

void PressureWatch::reset() noexcept {
  known_ = in_row_ = 0;
  measured_ = stale_ = false;
}

CommandMoves::CommandMoves(const ActuationSettings& actuation)
    : anchor_bar_(PressureVector::Zero(chamber_count(actuation))),
      anchored_ns_(actuation.segments.size(), kNever),
      began_ns_(actuation.segments.size(), kNever) {
  for (const auto& segment : actuation.segments) chambers_.push_back(std::ssize(segment));
}

void CommandMoves::command(std::int64_t now_ns, const PressureVector& commanded_bar) noexcept {
  Eigen::Index first = 0;
  std::int64_t newest_ns = kNever;
  for (std::size_t i = 0; i < chambers_.size(); ++i) {
    const auto now = commanded_bar.segment(first, chambers_[i]);
    auto anchor = anchor_bar_.segment(first, chambers_[i]);
    if (anchored_ns_[i] == kNever) anchored_ns_[i] = now_ns;
    if ((now - anchor).cwiseAbs().maxCoeff() > kNoticeable_bar) {
      newest_ns = std::max(newest_ns, anchored_ns_[i]);
      anchor = now;
      anchored_ns_[i] = now_ns;
    }
    newest_ns = std::max(newest_ns, began_ns_[i]);
    began_ns_[i] = newest_ns;
    first += chambers_[i];
  }
}

void FramePeriodWatch::frame(std::int64_t capture_ns) noexcept {
  if (frames_ == 0) {
    begin_ns_ = capture_ns;
    longest_ns_ = 0;
  } else {
    longest_ns_ = std::max(longest_ns_, capture_ns - last_ns_);
  }
  last_ns_ = capture_ns;
  ++frames_;
  if (frames_ <= kFrames || capture_ns - begin_ns_ < kPeriods * declared_ns_) return;
  mismatch_ = kFaster * longest_ns_ < declared_ns_;
  frames_ = 0;
}

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
  for (Eigen::Index i = 0; i < force_.size(); i += arm_.segment_dof())
    largest = std::max(largest, (force_.segment<2>(i) - actuated_.segment<2>(i)).norm());
  return largest;
}

OscillationWatch::OscillationWatch(const SafetySettings& settings, double period_s, int dof)
    : amplitude_rad_(settings.oscillation_rad),
      part_(settings.oscillation_part),
      share_(1.0 - std::exp(-2.0 * std::numbers::pi * settings.oscillation_lowest_hz * period_s)),
      longest_ticks_(static_cast<int>(
          std::min(std::ceil(0.5 / (settings.oscillation_lowest_hz * period_s)), 1e9))),
      half_periods_(2 * settings.oscillation_periods),
      coordinates_(static_cast<std::size_t>(dof)) {}

void OscillationWatch::reset() noexcept {
  std::fill(coordinates_.begin(), coordinates_.end(), Coordinate{});
  oscillates_ = false;
}

void OscillationWatch::judge(ConstVectorRef reference_rad, ConstVectorRef u_rad) noexcept {
  if (!(amplitude_rad_ > 0.0)) return;
  for (Eigen::Index i = 0; i < u_rad.size(); ++i) {
    Coordinate& it = coordinates_[static_cast<std::size_t>(i)];
    judge(it, it.error.pass(reference_rad[i] - u_rad[i], share_),
          std::abs(it.reference.pass(reference_rad[i], share_)));
  }
}

void OscillationWatch::judge(Coordinate& it, double error_rad, double reference_rad) noexcept {
  // Half the amplitude on the other side is a change of sign: noise is none.
  const bool turned = error_rad * it.extremum < 0.0 && std::abs(error_rad) > 0.5 * amplitude_rad_;
  if (turned) end_half_period(it);
  if (turned || std::abs(error_rad) > std::abs(it.extremum)) it.extremum = error_rad;
  it.reference_extremum = std::max(it.reference_extremum, reference_rad);
  it.ticks = std::min(it.ticks + 1, longest_ticks_ + 1);
  if (it.ticks > longest_ticks_) it.half_periods = 0;
}

void OscillationWatch::end_half_period(Coordinate& it) noexcept {
  constexpr double kFades = 0.7;
  const double size = std::abs(it.extremum);
  const double reference = std::max(it.reference_extremum, it.last_reference_extremum);
  const bool counts =
      size >= amplitude_rad_ && size >= part_ * reference && it.ticks <= longest_ticks_;
  if (!counts) {
    it.half_periods = 0;
  } else if (it.half_periods == 0 || size < kFades * it.first_extremum) {
    it.half_periods = 1;
    it.first_extremum = size;
  } else {
    ++it.half_periods;
  }
  oscillates_ |= it.half_periods >= half_periods_;
  it.last_reference_extremum = it.reference_extremum;
  it.reference_extremum = 0.0;
  it.ticks = 0;
}

// What remains after the slow part, twice.
double OscillationWatch::HighPass::pass(double value, double share) noexcept {
  if (!started_) slow_ = value;
  started_ = true;
  slow_ += share * (value - slow_);
  const double fast = value - slow_;
  slower_ += share * (fast - slower_);
  return fast - slower_;
}

LengthWatch::LengthWatch(const SafetySettings& settings, const ArmParameters& arm,
                         const SegmentScalars& most_elongation_m)
    : settling_ns_(to_ns(settings.length_settling_s)),
      warning_{.relative = settings.length_warning},
      fault_{.relative = settings.length_fault} {
  for (const SegmentParameters& segment : arm.segments) length_m_.push_back(segment.length_m);
  reach_m_.assign(most_elongation_m.begin(), most_elongation_m.end());
  reach_m_.resize(length_m_.size());
  reset();
}

void LengthWatch::reset() noexcept {
  for (Limit* limit : {&warning_, &fault_}) {
    limit->since_ns.fill(kNever);
    limit->exceeded = limit->beyond = false;
  }
}

void LengthWatch::judge(std::int64_t capture_ns, const CurvatureEstimate& estimate,
                        const SegmentVector* expected) noexcept {
  judge(capture_ns, estimate, expected, warning_);
  judge(capture_ns, estimate, expected, fault_);
}

void LengthWatch::judge(std::int64_t capture_ns, const CurvatureEstimate& estimate,
                        const SegmentVector* expected, Limit& limit) noexcept {
  if (limit.relative <= 0.0) return;
  limit.exceeded = limit.beyond = false;
  for (std::size_t i = 0; i < length_m_.size(); ++i) {
    const double allowed_m = limit.relative * length_m_[i];
    const bool evident =
        estimate.valid[i] && 3.0 * std::sqrt(estimate.length_variance_m2[i]) <= allowed_m;
    std::int64_t& since_ns = limit.since_ns[i];
    if (evident) {
      const auto e = static_cast<Eigen::Index>(3 * i + 2);
      const double least_m = expected != nullptr ? (*expected)[e] : 0.0;
      const double most_m = expected != nullptr ? least_m : reach_m_[i];
      const double elongation_m = estimate.length_m[i] - length_m_[i];
      const bool off = elongation_m < least_m - allowed_m || elongation_m > most_m + allowed_m;
      since_ns = !off ? kNever : since_ns == kNever ? capture_ns : since_ns;
    }
    limit.beyond |= since_ns != kNever;
    limit.exceeded |= since_ns != kNever && capture_ns - since_ns >= settling_ns_;
  }
}

}  // namespace softarm
