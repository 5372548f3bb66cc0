#include "softarm/estimation/stale_bodies.hpp"

#include <algorithm>
#include <cmath>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {

/// Standard deviations of a body's noise that count as a movement, and the least that does.
constexpr double kNoiseMargin = 3.0;
constexpr double kLeastMove_m = 1e-4;
constexpr double kLeastMove_rad = 1e-3;

/// A step from one frame to the next that shows noise or motion, not the rounding of numbers.
constexpr double kStep_m = 1e-6;
constexpr double kStep_rad = 1e-5;

bool same_bits(const BodyPose& a, const BodyPose& b) {
  return a.position_m == b.position_m && a.orientation.coeffs() == b.orientation.coeffs();
}

/// Orientations by the distance of their quaternions, half the angle; q and -q mean the same.
bool moved(const BodyPose& from, const BodyPose& to, double distance_m, double angle_rad) {
  const Eigen::Vector4d a = from.orientation.coeffs(), b = to.orientation.coeffs();
  const double half2 = std::min((a - b).squaredNorm(), (a + b).squaredNorm());
  return (to.position_m - from.position_m).squaredNorm() > distance_m * distance_m ||
         4.0 * half2 > angle_rad * angle_rad;
}

}  // namespace

StaleBodies::StaleBodies(const EstimationSettings& settings, int segments)
    : stale_frames_(settings.stale_frames),
      noticeable_m_(std::max(kLeastMove_m, kNoiseMargin * settings.position_noise_m)),
      noticeable_rad_(std::max(kLeastMove_rad, kNoiseMargin * settings.orientation_noise_rad)),
      watched_(static_cast<std::size_t>(segments) + 1) {
  reset();
}

void StaleBodies::reset() noexcept {
  std::fill(watched_.begin(), watched_.end(), Watched{});
  motion_began_ns_ = kNever;
}

void StaleBodies::look(const BodyPose& pose, std::int64_t capture_ns, Watched& body) noexcept {
  const std::int64_t before_ns = body.seen_ns;
  body.seen_ns = capture_ns;
  const bool first = !body.pose.valid;
  if (!first && same_bits(pose, body.pose)) {
    ++body.repeats;
    return;
  }
  if (!first && moved(body.pose, pose, kStep_m, kStep_rad)) body.step_began_ns = before_ns;
  body.pose = pose;
  body.changed_ns = capture_ns;
  body.repeats = body.command_frames = 0;
  body.stale = false;
  if (!first && !moved(body.anchor, pose, noticeable_m_, noticeable_rad_)) return;
  if (!first) motion_began_ns_ = std::max(motion_began_ns_, body.anchored_ns);
  body.anchor = pose;
  body.anchored_ns = capture_ns;
}

void StaleBodies::observe(const MocapFrame& frame, const CommandedMotion& commanded) noexcept {
  for (std::size_t b = 0; b < watched_.size(); ++b)
    if (frame.body[b].valid) look(frame.body[b], frame.capture_ns, watched_[b]);

  const bool judges_commands =
      commanded.frozen_frames > 0 && commanded.began_ns.size() + 1 == watched_.size();
  std::size_t frozen = 0;
  const auto is_frozen = [&](const Watched& body) {
    return body.repeats >= 2 * commanded.frozen_frames &&
           body.command_frames >= commanded.frozen_frames;
  };
  std::int64_t above_stepped_ns = kNever;
  for (std::size_t b = 1; b < watched_.size(); ++b) {
    Watched& body = watched_[b];
    above_stepped_ns = std::max(above_stepped_ns, watched_[b - 1].step_began_ns);
    if (body.repeats == 0) continue;
    if (stale_frames_ > 0 && body.repeats >= stale_frames_ &&
        std::min(motion_began_ns_, above_stepped_ns) >= body.changed_ns)
      body.stale = true;
    if (!judges_commands) continue;
    if (commanded.began_ns[b - 1] >= body.changed_ns) ++body.command_frames;
    if (is_frozen(body)) ++frozen;
  }
  if (!judges_commands || frozen == 0 || frozen + 1 == watched_.size()) return;
  for (std::size_t b = 1; b < watched_.size(); ++b)
    if (is_frozen(watched_[b])) watched_[b].stale = true;
}

}  // namespace softarm
