#include "softarm/daemon/safety_monitor.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace softarm {
namespace {

/// Everything a cause may look at.
struct Evidence {
  const SafetyInput& input;
  const SafetySettings& settings;
  const SafetyThresholds& thresholds;
  Mode mode;
  std::int64_t frame_age_ns;
  std::int64_t tick_gap_ns;
  std::int64_t measurement_age_ns;
};

/// Overruns are judged only under SCHED_FIFO (consecutive_overruns is zero otherwise): without it
/// they are only counted.
struct Cause {
  Reason reason;
  Mode demands;
  bool (*present)(const Evidence&);
};

/// Every cause, the most severe first. A cause is cleared when it is no longer present; `shutdown`
/// never is, and a fault stays latched until an operator disarms.
constexpr std::array kCauses{
    Cause{Reason::valves_silent, Mode::fault,
          [](const Evidence& e) {
            return e.settings.valve_readback && e.mode == Mode::active &&
                   e.measurement_age_ns > e.thresholds.valve_silence_ns;
          }},
    Cause{Reason::shutdown, Mode::vent, [](const Evidence& e) { return e.input.shutdown; }},
    Cause{Reason::disarmed, Mode::vent, [](const Evidence& e) { return e.input.disarm; }},
    Cause{Reason::time_gap, Mode::vent,
          [](const Evidence& e) { return e.tick_gap_ns > e.thresholds.vent_after_ns; }},
    Cause{Reason::sender_restarted, Mode::vent,
          [](const Evidence& e) { return e.input.sender_restarted; }},
    Cause{Reason::frames_stale, Mode::vent,
          [](const Evidence& e) { return e.frame_age_ns > e.thresholds.vent_after_ns; }},
    Cause{Reason::soft_limit, Mode::vent,
          [](const Evidence& e) { return e.input.soft_limit_exceeded; }},
    Cause{Reason::many_overruns, Mode::vent,
          [](const Evidence& e) {
            return e.settings.vent_overruns > 0 &&
                   e.input.consecutive_overruns >= e.settings.vent_overruns;
          }},
    Cause{Reason::frames_late, Mode::hold,
          [](const Evidence& e) {
            return e.input.motion_unknown || e.frame_age_ns > e.thresholds.hold_after_ns;
          }},
    Cause{Reason::poses_frozen, Mode::hold, [](const Evidence& e) { return e.input.poses_frozen; }},
    Cause{Reason::overruns, Mode::hold,
          [](const Evidence& e) {
            return e.settings.hold_overruns > 0 &&
                   e.input.consecutive_overruns >= e.settings.hold_overruns;
          }},
};

/// a - b without overflow where b is "never" (the smallest number).
std::int64_t age(std::int64_t now_ns, std::int64_t then_ns) noexcept {
  constexpr auto kNever = std::numeric_limits<std::int64_t>::min();
  return then_ns == kNever ? std::numeric_limits<std::int64_t>::max() : now_ns - then_ns;
}

/// The values named may come off the wire.
template <class Enumeration, std::size_t count>
const char* name_of(Enumeration value, const std::array<const char*, count>& names) noexcept {
  const auto index = static_cast<std::size_t>(value);
  return index < count ? names[index] : "unknown";
}

}  // namespace

const char* name(Mode mode) noexcept {
  constexpr std::array kNames{"INIT", "WAIT_FRAMES", "ACTIVE", "HOLD", "VENT", "FAULT"};
  return name_of(mode, kNames);
}

const char* name(Reason reason) noexcept {
  constexpr std::array kNames{
      "none",         "starting",      "waiting_for_frames", "waiting_for_arm",  "frames_late",
      "poses_frozen", "overruns",      "frames_stale",       "sender_restarted", "soft_limit",
      "time_gap",     "many_overruns", "disarmed",           "shutdown",         "valves_silent"};
  return name_of(reason, kNames);
}

SafetyThresholds resolve_thresholds(const SafetySettings& settings,
                                    double control_period_s) noexcept {
  const double hold_s = settings.hold_after_s > 0.0
                            ? settings.hold_after_s
                            : std::max(3.0 * control_period_s,
                                       3.0 * settings.frame_period_s + settings.frame_latency_s);
  const double vent_s =
      settings.vent_after_s > 0.0
          ? settings.vent_after_s
          : std::max({0.1, 10.0 * settings.frame_period_s, 3.0 * control_period_s});
  return {.hold_after_ns = std::llround(hold_s * 1e9), .vent_after_ns = std::llround(vent_s * 1e9)};
}

SafetyMonitor::SafetyMonitor(const SafetySettings& settings, double control_period_s) noexcept
    : settings_(settings),
      thresholds_(resolve_thresholds(settings, control_period_s)),
      armed_(settings.arming == Arming::automatic) {}

SafetyMonitor::Verdict SafetyMonitor::worst_cause(const SafetyInput& input) const noexcept {
  const bool ticked_before = mode_ != Mode::init;
  const Evidence evidence{.input = input,
                          .settings = settings_,
                          .thresholds = thresholds_,
                          .mode = mode_,
                          .frame_age_ns = age(input.now_ns, input.newest_capture_ns),
                          .tick_gap_ns = ticked_before ? input.now_ns - previous_tick_ns_ : 0,
                          .measurement_age_ns = age(input.now_ns, input.newest_measurement_ns)};
  for (const Cause& cause : kCauses)
    if (cause.present(evidence)) return {cause.demands, cause.reason};
  return {Mode::active, Reason::none};
}

void SafetyMonitor::take_operator_requests(const SafetyInput& input, Mode demanded) noexcept {
  // Armed is granted for what the operator sees now, never stored up for when a cause has gone.
  if (input.arm && demanded < Mode::vent) armed_ = true;
  if (input.disarm || input.shutdown) armed_ = false;
}

void SafetyMonitor::enter(Mode mode, Reason reason) noexcept {
  // A vent or a fault takes the arming back. With automatic arming it comes back by itself, but not
  // to an arm that ran beyond its limits: it would do so again and again.
  const bool always = mode == Mode::fault || reason == Reason::soft_limit;
  if (mode >= Mode::vent && (always || settings_.arming == Arming::explicit_)) armed_ = false;
  mode_ = mode;
  reason_ = reason;
}

void SafetyMonitor::try_to_activate(const SafetyInput& input, Reason otherwise) noexcept {
  const bool vented_enough = mode_ == Mode::hold || input.fully_vented;
  if (!vented_enough) return;
  if (good_in_a_row_ < settings_.good_frames) {
    reason_ = otherwise;
  } else if (!armed_) {
    reason_ = Reason::waiting_for_arm;
  } else {
    enter(Mode::active, Reason::none);
  }
}

Mode SafetyMonitor::step(const SafetyInput& input) noexcept {
  const Verdict verdict = worst_cause(input);
  take_operator_requests(input, verdict.demands);
  previous_tick_ns_ = input.now_ns;
  if (mode_ == Mode::init) enter(Mode::wait_frames, Reason::waiting_for_frames);

  // A run of good frames is one without a cause, a rejection or a gap, and begins anew with the arm
  // vented: until then it is moving.
  const bool still_venting = mode_ == Mode::vent && !input.fully_vented;
  if (verdict.demands > Mode::active || input.bad_frames > 0 || still_venting) {
    good_in_a_row_ = 0;
  } else {
    good_in_a_row_ = std::min(good_in_a_row_ + input.good_frames, settings_.good_frames);
  }

  switch (mode_) {
    case Mode::init:
    case Mode::wait_frames:
      // Nothing is pressurised: only what latches matters, the rest is waiting.
      if (verdict.reason == Reason::shutdown) {
        enter(Mode::vent, verdict.reason);
      } else {
        try_to_activate(input, Reason::waiting_for_frames);
      }
      break;
    case Mode::active:
    case Mode::hold:
      if (verdict.demands > mode_ || (verdict.demands == mode_ && mode_ == Mode::hold)) {
        enter(verdict.demands, verdict.reason);
      } else if (mode_ == Mode::hold) {
        try_to_activate(input, reason_);
      }
      break;
    case Mode::vent:
      if (verdict.demands >= Mode::vent) {
        enter(verdict.demands, verdict.reason);
      } else if (verdict.demands == Mode::active) {
        try_to_activate(input, reason_);
      }
      break;
    case Mode::fault:
      // Disarming acknowledges the fault; the arm stays vented until it is armed again.
      if (input.disarm || input.shutdown)
        enter(Mode::vent, input.shutdown ? Reason::shutdown : Reason::disarmed);
      break;
  }
  return mode_;
}

}  // namespace softarm
