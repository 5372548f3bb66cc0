#include "softarm/estimation/frame_validator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {

// Frames may overtake one another by a few numbers; a number further back is a sender that
// restarted.
constexpr std::uint64_t kMaxReorder = 16;
// So is a run of old numbers that counts up among itself: a sender that died before its 17th frame.
constexpr int kRestartRun = 3;
// A gap in the numbers counts for no more than this, so that a nonsensical number cannot overflow
// the total.
constexpr std::uint64_t kMaxCountedGap = 1'000'000;
// A jump must exceed what noise explains: standard deviations of the difference of two
// measurements.
constexpr double kNoiseMargin = 8.0;

/// Of every FrameVerdict, in its order.
constexpr std::int64_t FrameCounters::*kCounters[] = {
    &FrameCounters::accepted,       &FrameCounters::repeated,   &FrameCounters::out_of_order,
    &FrameCounters::restarted,      &FrameCounters::wrong_size, &FrameCounters::not_finite,
    &FrameCounters::bad_quaternion, &FrameCounters::bad_length, &FrameCounters::jump,
    &FrameCounters::not_seen,       &FrameCounters::bad_torsion};
static_assert(std::size(kCounters) == kFrameVerdicts);

bool finite(const BodyPose& body) {
  return body.position_m.allFinite() && body.orientation.coeffs().allFinite();
}

bool identical(const BodyPose& a, const BodyPose& b) {
  if (a.valid != b.valid) return false;
  return !a.valid ||
         (a.position_m == b.position_m && a.orientation.coeffs() == b.orientation.coeffs());
}

void require_positive(double value, const char* name) {
  if (!(value > 0.0) || !std::isfinite(value)) {
    throw std::invalid_argument(fmt::format("expected a {} > 0, got {}", name, value));
  }
}

}  // namespace

const char* name(FrameVerdict verdict) noexcept {
  constexpr const char* kNames[] = {"accepted",         "repeated",   "out_of_order",
                                    "sender_restarted", "wrong_size", "not_finite",
                                    "bad_quaternion",   "bad_length", "jump",
                                    "not_seen",         "bad_torsion"};
  static_assert(std::size(kNames) == kFrameVerdicts);
  const auto index = static_cast<std::size_t>(verdict);
  return index < std::size(kNames) ? kNames[index] : "unknown";
}

std::int64_t FrameCounters::of(FrameVerdict verdict) const noexcept {
  const auto index = static_cast<std::size_t>(verdict);
  return index < std::size(kCounters) ? this->*kCounters[index] : 0;
}

FrameValidator::FrameValidator(const EstimationSettings& settings, const ArmParameters& arm,
                               std::span<const BodyNoise> noise)
    : settings_(settings), estimator_(settings, arm, noise), stale_(settings, arm.size()) {
  require_positive(settings.quaternion_tolerance, "quaternion_tolerance");
  require_positive(settings.length_tolerance, "length_tolerance");
  require_positive(settings.torsion_tolerance_rad, "torsion_tolerance_rad");
  require_positive(settings.max_speed_radps, "max_speed_radps");
  for (const SegmentParameters& segment : arm.segments) length_m_.push_back(segment.length_m);
  reset();
}

void FrameValidator::reset() noexcept {
  has_number_ = false;
  has_frame_ = false;
  old_in_row_ = 0;
  identical_in_row_ = 0;
  seen_.fill(false);
  stale_.reset();
}

FrameVerdict FrameValidator::accept(const MocapFrame& frame,
                                    const CommandedMotion& commanded) noexcept {
  const FrameVerdict verdict = judge(frame, commanded);
  ++(counters_.*kCounters[static_cast<std::size_t>(verdict)]);
  if (verdict == FrameVerdict::accepted) remember(frame);
  if (verdict == FrameVerdict::sender_restarted) {
    reset();
    has_number_ = true;
    last_number_ = frame.frame_number;
  }
  return verdict;
}

FrameVerdict FrameValidator::judge(const MocapFrame& frame,
                                   const CommandedMotion& commanded) noexcept {
  if (frame.segments != estimator_.segments()) return FrameVerdict::wrong_size;
  FrameVerdict verdict = judge_number(frame.frame_number);
  if (verdict != FrameVerdict::accepted) return verdict;
  if (has_frame_ && frame.capture_ns <= last_.capture_ns) return FrameVerdict::out_of_order;
  verdict = judge_poses(frame);
  if (verdict != FrameVerdict::accepted) return verdict;
  verdict = judge_segments(frame);
  if (verdict != FrameVerdict::accepted) return verdict;
  return leave_out_stale_bodies(frame, commanded);
}

FrameVerdict FrameValidator::judge_number(std::int64_t number) noexcept {
  // Unsigned differences: the numbers come from the wire and may be anything.
  const auto distance = [](std::int64_t from, std::int64_t to) {
    return static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from);
  };
  if (!has_number_ || number > last_number_) {
    if (has_number_) {
      const std::uint64_t gap = distance(last_number_, number) - 1;
      counters_.missing += static_cast<std::int64_t>(std::min(gap, kMaxCountedGap));
    }
    // A frame whose poses are refused has arrived all the same and is not missing.
    has_number_ = true;
    last_number_ = number;
    old_in_row_ = 0;
    return FrameVerdict::accepted;
  }
  if (number == last_number_) return FrameVerdict::repeated;
  old_in_row_ = old_in_row_ > 0 && number > last_old_number_ ? old_in_row_ + 1 : 1;
  last_old_number_ = number;
  const bool restarted = distance(number, last_number_) > kMaxReorder || old_in_row_ >= kRestartRun;
  return restarted ? FrameVerdict::sender_restarted : FrameVerdict::out_of_order;
}

FrameVerdict FrameValidator::judge_poses(const MocapFrame& frame) const noexcept {
  for (std::size_t i = 0; i <= length_m_.size(); ++i) {
    const BodyPose& body = frame.body[i];
    if (!body.valid) continue;
    if (!finite(body)) return FrameVerdict::not_finite;
    if (!(std::abs(body.orientation.norm() - 1.0) <= settings_.quaternion_tolerance)) {
      return FrameVerdict::bad_quaternion;
    }
  }
  return FrameVerdict::accepted;
}

FrameVerdict FrameValidator::judge_segments(const MocapFrame& frame) noexcept {
  estimator_.estimate(frame, candidate_);
  bool any = false;
  bool jumped = false;
  for (std::size_t i = 0; i < length_m_.size(); ++i) {
    if (!frame.body[i].valid || !frame.body[i + 1].valid) continue;
    if (!candidate_.valid[i]) return FrameVerdict::bad_length;
    any = true;
    const double chord = (frame.body[i + 1].position_m - frame.body[i].position_m).norm();
    // Inertial sensors leave the positions at zero.
    const bool has_chord = settings_.method != CurvatureMethod::orientation || chord > 0.0;
    const double slack = settings_.length_tolerance * length_m_[i];
    if (has_chord && !(chord <= length_m_[i] + slack)) return FrameVerdict::bad_length;
    // Before the length by the bend, which a turned body bends too.
    if (!(std::abs(candidate_.torsion_rad[i]) <= settings_.torsion_tolerance_rad))
      return FrameVerdict::bad_torsion;
    if (has_chord && !(std::abs(candidate_.length_error_m[i]) <= slack))
      return FrameVerdict::bad_length;
    if (!seen_[i]) continue;
    const double passed_s = to_seconds(frame.capture_ns - seen_ns_[i]);
    const double noise = std::sqrt(candidate_.variance_rad2[i] + seen_variance_rad2_[i]);
    const Eigen::Vector2d u = candidate_.u_rad.segment<2>(2 * static_cast<Eigen::Index>(i));
    jumped = jumped || !((u - seen_u_rad_[i]).norm() <=
                         settings_.max_speed_radps * passed_s + kNoiseMargin * noise);
  }
  if (!any) return FrameVerdict::not_seen;
  return jumped ? FrameVerdict::jump : FrameVerdict::accepted;
}

/// Of a frame that is right otherwise: one that is refused is no evidence of what moves.
FrameVerdict FrameValidator::leave_out_stale_bodies(const MocapFrame& frame,
                                                    const CommandedMotion& commanded) noexcept {
  stale_.observe(frame, commanded);
  bool any = false, some_stale = false;
  for (std::size_t i = 0; i < length_m_.size(); ++i) {
    some_stale = some_stale || stale_.stale(i + 1);
    if (stale_.stale(i) || stale_.stale(i + 1)) candidate_.leave_out(static_cast<int>(i));
    any = any || candidate_.valid[i];
  }
  if (some_stale) ++counters_.stale;
  return any ? FrameVerdict::accepted : FrameVerdict::not_seen;
}

void FrameValidator::remember(const MocapFrame& frame) noexcept {
  bool same = has_frame_;
  for (std::size_t i = 0; same && i <= length_m_.size(); ++i) {
    same = identical(frame.body[i], last_.body[i]);
  }
  identical_in_row_ = same ? identical_in_row_ + 1 : 0;
  last_ = frame;
  for (std::size_t i = 1; i <= length_m_.size(); ++i)
    last_.body[i].valid = frame.body[i].valid && !stale_.stale(i);
  has_frame_ = true;
  estimate_ = candidate_;
  for (std::size_t i = 0; i < length_m_.size(); ++i) {
    if (!estimate_.valid[i]) continue;
    seen_[i] = true;
    seen_ns_[i] = frame.capture_ns;
    seen_u_rad_[i] = estimate_.u_rad.segment<2>(2 * static_cast<Eigen::Index>(i));
    seen_variance_rad2_[i] = estimate_.variance_rad2[i];
  }
}

}  // namespace softarm
