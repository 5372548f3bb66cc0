#include "softarm/client/commander.hpp"

#include <algorithm>
#include <cmath>

#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/transport/lcm_node.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kPeriod_ns = 10'000'000;
constexpr std::int64_t kRest_ns = 1'000'000'000;

}  // namespace

Commander::Commander(const Experiment& experiment, LcmNode& node)
    : lock_(lock_name(experiment.transport.lcm.command_channel, experiment.transport.lcm.url)),
      node_(node),
      experiment_(experiment),
      vent_ramps_(experiment.actuation),
      bar_(PressureVector::Zero(chamber_count(experiment.actuation))),
      period_ns_(std::min(
          kPeriod_ns, static_cast<std::int64_t>(2.5e8 * experiment.safety.command_validity_s))) {
  message_.validity_us =
      static_cast<std::int32_t>(std::llround(1e6 * experiment.safety.command_validity_s));
  message_.shadow = 0;
  message_.num_chambers = static_cast<std::int16_t>(bar_.size());
  message_.sequence = 0;
  message_.time_us = 0;
}

void Commander::update(const PressureVector& wanted_bar, double rate_bar_per_s,
                       std::int64_t now_ns) {
  ActuationSettings limits = experiment_.actuation;
  limits.segments.clear();
  limits.slew_bar_per_s = std::min(limits.slew_bar_per_s, rate_bar_per_s);
  PressureRamps(limits).limit(bar_, wanted_bar, step_s(now_ns), bar_);
  send(now_ns);
}

void Commander::vent(std::int64_t now_ns) {
  vent_ramps_.vent(bar_, step_s(now_ns), bar_);
  send(now_ns);
}

void Commander::vent_to_rest() {
  std::int64_t now_ns = monotonic_now_ns();
  for (std::int64_t end_ns = now_ns + kRest_ns; now_ns < end_ns; now_ns = monotonic_now_ns()) {
    if (bar_.maxCoeff() > 0.0) end_ns = now_ns + kRest_ns;
    vent(now_ns);
    node_.wait_until(next_ns_);
  }
}

// No step makes up for a stall.
double Commander::step_s(std::int64_t now_ns) {
  const std::int64_t passed_ns = std::clamp<std::int64_t>(now_ns - updated_ns_, 0, period_ns_);
  updated_ns_ = now_ns;
  return to_seconds(passed_ns);
}

void Commander::send(std::int64_t now_ns) {
  if (now_ns < next_ns_) return;
  next_ns_ = now_ns + period_ns_;
  // A stall that the last command did not outlive, were it since `now_ns`, has vented the valves.
  const std::int64_t sent_us = monotonic_now_ns() / 1000;
  if (sent_us - message_.time_us >= message_.validity_us) {
    bar_.setZero();
    held_up_ |= message_.sequence > 0;
  }
  ++message_.sequence;
  message_.time_us = sent_us;
  message_.pressure_bar.assign(bar_.begin(), bar_.end());
  if (!node_.publish(experiment_.transport.lcm.command_channel, message_))
    throw TransportError("a command could not be sent: see tools/with_loopback_network --check");
}

}  // namespace softarm
