#include "softarm/transport/frame_assembler.hpp"

#include <cstdlib>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {

bool same_pose(const BodyPose& a, const BodyPose& b) noexcept {
  return a.position_m == b.position_m && a.orientation.coeffs() == b.orientation.coeffs();
}

}  // namespace

FrameAssembler::FrameAssembler(int segments, bool fixed_base, double frame_period_s) noexcept
    : bodies_(static_cast<std::size_t>(segments) + 1),
      first_(fixed_base ? 1 : 0),
      half_period_ns_(to_ns(0.5 * frame_period_s)) {}

void FrameAssembler::put(std::size_t body, const BodyPose& pose, std::int64_t stamp_us) noexcept {
  current_.body[body] = {true, stamp_us, pose};
  ++current_.seen;
  if (current_.seen == static_cast<int>(bodies_ - first_)) finish();
}

void FrameAssembler::finish() noexcept {
  if (!under_way_) return;
  under_way_ = false;
  has_done_ = true;
  done_ = current_;
  ++number_;
}

FrameAssembler::Outcome FrameAssembler::begin(std::size_t body, const BodyPose& pose,
                                              std::int64_t stamp_us,
                                              std::int64_t arrival_ns) noexcept {
  finish();
  for (std::size_t i = 0; i < bodies_; ++i) current_.body[i].seen = false;
  current_.stamp_us = stamp_us;
  current_.arrival_ns = arrival_ns;
  current_.seen = 0;
  begun_ = under_way_ = true;
  put(body, pose, stamp_us);
  return Outcome::begun;
}

FrameAssembler::Outcome FrameAssembler::add(std::size_t body, const BodyPose& pose,
                                            std::int64_t stamp_us,
                                            std::int64_t arrival_ns) noexcept {
  if (body < first_ || body >= bodies_) return Outcome::dropped;
  if (!begun_) return begin(body, pose, stamp_us, arrival_ns);
  const Body& known = current_.body[body];
  const std::int64_t later_ns = 1000 * (stamp_us - current_.stamp_us);
  if (std::abs(later_ns) < half_period_ns_ && arrival_ns - current_.arrival_ns >= half_period_ns_) {
    const bool moved = known.seen && stamp_us == known.stamp_us && !same_pose(pose, known.pose);
    if (moved || clock_.coarse()) {
      clock_.count(true);
      old_in_row_ = 0;
      return begin(body, pose, stamp_us, arrival_ns);
    }
  }
  const bool newer = later_ns >= half_period_ns_ || (known.seen && stamp_us > known.stamp_us);
  if (newer) {
    clock_.count(false);
    old_in_row_ = 0;
    return begin(body, pose, stamp_us, arrival_ns);
  }
  if (later_ns <= -half_period_ns_) {
    if (++old_in_row_ < 2 * static_cast<int>(bodies_ - first_)) return Outcome::dropped;
    old_in_row_ = 0;
    return begin(body, pose, stamp_us, arrival_ns);
  }
  old_in_row_ = 0;
  if (known.seen || !under_way_) return Outcome::dropped;
  put(body, pose, stamp_us);
  return Outcome::waiting;
}

void FrameAssembler::set_capture_ns(std::int64_t capture_ns) noexcept {
  current_.capture_ns = capture_ns;
  if (!under_way_) done_.capture_ns = capture_ns;  // complete with its first body
}

bool FrameAssembler::take_done(MocapFrame& frame) noexcept {
  if (!has_done_) return false;
  has_done_ = false;
  frame.frame_number = number_;
  frame.capture_ns = done_.capture_ns;
  for (std::size_t i = first_; i < bodies_; ++i) {
    frame.body[i] = done_.body[i].pose;
    frame.body[i].valid = done_.body[i].seen;
  }
  return true;
}

void FrameAssembler::look_at_clock(std::int64_t now_ns) noexcept {
  if (under_way_ && now_ns - current_.arrival_ns >= half_period_ns_) finish();
}

}  // namespace softarm
