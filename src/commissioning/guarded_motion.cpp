#include "commissioning/guarded_motion.hpp"

#include <fmt/format.h>

namespace softarm {

std::string GuardedMotion::reason_to_end() const {
  const MotionLimits& limits = client_.experiment().motion_limits;
  const SeenArm& seen = client_.seen();
  if (stop_ && stop_()) return "stopped";
  if (client_.held_up()) return ArmClient::kHeldUp;
  if (client_.daemon_armed()) return "a daemon is armed: " + client_.daemon_text();
  if (std::string other = client_.other_commander(); !other.empty()) return other;
  if (seen.arrival_ns == kNever || client_.now_ns() - seen.arrival_ns > lost_ns_)
    return fmt::format("no frame with every segment for {} ms", lost_ns_ / 1'000'000);
  if (seen.bend_rad > limits.max_theta_rad)
    return fmt::format(
        "a segment bends by {:.3g} rad, beyond identification.max_theta_rad of {:.3g} rad",
        seen.bend_rad, limits.max_theta_rad);
  if (seen.speed_radps > limits.max_speed_radps)
    return fmt::format(
        "a segment moves at {:.3g} rad/s, beyond identification.max_speed_radps of {:.3g} rad/s",
        seen.speed_radps, limits.max_speed_radps);
  return {};
}

void GuardedMotion::command(const PressureVector& bar, double rate_bar_per_s,
                            const std::function<bool()>& done) {
  while (!done()) {
    if (aborted_.empty()) aborted_ = reason_to_end();
    if (!aborted_.empty()) return;
    client_.command_chambers(bar, rate_bar_per_s);
    client_.update(client_.next_command_ns());
  }
}

}  // namespace softarm
