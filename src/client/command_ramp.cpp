#include "client/command_ramp.hpp"

#include <algorithm>
#include <cmath>

#include "softarm/actuation/command_expiry.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kPeriod_ns = 10'000'000;

}  // namespace

CommandRamp::CommandRamp(const ActuationSettings& actuation, double validity_s)
    : actuation_(actuation),
      vent_ramps_(actuation),
      bar_(PressureVector::Zero(chamber_count(actuation))),
      period_ns_(std::min(kPeriod_ns, to_ns(0.25 * validity_s))) {
  actuation_.segments.clear();  // only the limits are needed from here on
  message_.validity_us = static_cast<std::int32_t>(std::llround(1e6 * validity_s));
  message_.shadow = 0;
  message_.num_chambers = static_cast<std::int16_t>(bar_.size());
  message_.sequence = 0;
  message_.time_us = 0;
}

void CommandRamp::approach(const PressureVector& wanted_bar, double rate_bar_per_s,
                           std::int64_t now_ns) {
  ActuationSettings limits = actuation_;
  limits.slew_bar_per_s = std::min(limits.slew_bar_per_s, rate_bar_per_s);
  PressureRamps(limits).limit(bar_, wanted_bar, step_s(now_ns), bar_);
}

void CommandRamp::vent(std::int64_t now_ns) { vent_ramps_.vent(bar_, step_s(now_ns), bar_); }

// A stall is not caught up with.
double CommandRamp::step_s(std::int64_t now_ns) {
  const std::int64_t passed_ns = std::clamp<std::int64_t>(now_ns - updated_ns_, 0, period_ns_);
  updated_ns_ = now_ns;
  return to_seconds(passed_ns);
}

void CommandRamp::interrupt() {
  bar_.setZero();
  if (sent_ns_ != kNever) held_up_ = true;  // else the valves vented after another's commands
}

const softarm_messages::pressure_command_t& CommandRamp::next(std::int64_t now_ns) {
  const bool first = sent_ns_ == kNever;
  if (!first && has_expired(message_.time_us, message_.validity_us, now_ns / 1000)) {
    interrupt();
  }
  if (first) bar_.setZero();
  next_ns_ = now_ns + period_ns_;
  sent_ns_ = now_ns;
  ++message_.sequence;
  message_.time_us = now_ns / 1000;
  message_.pressure_bar.assign(bar_.begin(), bar_.end());
  sent_.add(message_.sequence, message_.time_us);
  return message_;
}

}  // namespace softarm
