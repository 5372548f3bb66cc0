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
    &FrameCounters::not_seen};
static_assert(std::size(kCounters) == static_cast<std::size_t>(FrameVerdict::not_seen) + 1);

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

FrameValidator::FrameValidator(const EstimationSettings& settings, const ArmParameters& arm,
                               std::span<const BodyNoise> noise)
    : settings_(settings), estimator_(settings, arm, noise) {
  require_positive(settings.quaternion_tolerance, "quaternion_tolerance");
  require_positive(settings.length_tolerance, "length_tolerance");
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
}

FrameVerdict FrameValidator::accept(const MocapFrame& frame) noexcept {
  const FrameVerdict verdict = judge(frame);
  ++(counters_.*kCounters[static_cast<std::size_t>(verdict)]);
  if (verdict == FrameVerdict::accepted) remember(frame);
  if (verdict == FrameVerdict::sender_restarted) {
    reset();
    has_number_ = true;
    last_number_ = frame.frame_number;
  }
  return verdict;
}

FrameVerdict FrameValidator::judge(const MocapFrame& frame) noexcept {
  if (frame.segments != estimator_.segments()) return FrameVerdict::wrong_size;
  FrameVerdict verdict = judge_number(frame.frame_number);
  if (verdict != FrameVerdict::accepted) return verdict;
  if (has_frame_ && frame.capture_ns <= last_.capture_ns) return FrameVerdict::out_of_order;
  verdict = judge_poses(frame);
  if (verdict != FrameVerdict::accepted) return verdict;
  return judge_segments(frame);
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
    if (has_chord &&
        !(chord <= length_m_[i] + slack && std::abs(candidate_.length_error_m[i]) <= slack)) {
      return FrameVerdict::bad_length;
    }
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

void FrameValidator::remember(const MocapFrame& frame) noexcept {
  bool same = has_frame_;
  for (std::size_t i = 0; same && i <= length_m_.size(); ++i) {
    same = identical(frame.body[i], last_.body[i]);
  }
  identical_in_row_ = same ? identical_in_row_ + 1 : 0;
  last_ = frame;
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
