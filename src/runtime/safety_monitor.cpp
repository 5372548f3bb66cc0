#include "softarm/runtime/safety_monitor.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "softarm/base/time.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {
namespace {

/// For this long after a stop of the daemon, messages may have been sent before its end: they were
/// queued in the kernel.
constexpr std::int64_t kStale_ns = 500'000'000;
/// For this long after a command of another program, there may be a next one.
constexpr std::int64_t kForeign_ns = 1'000'000'000;
/// An `arm` waits for the vent to end, which takes less than 1 s, and for good frames.
constexpr double kArmLapses_s = 2.0;

/// Everything that a cause may depend on.
struct Evidence {
  const SafetyInput& input;
  const SafetySettings& settings;
  const SafetyThresholds& thresholds;
  Mode mode;
  std::int64_t frame_age_ns;
  std::int64_t tick_gap_ns;
  std::int64_t measurement_age_ns;
  std::int64_t go_age_ns;
  std::int64_t foreign_age_ns;
  std::int64_t law_overdue_ns;  ///< since the newest answer expired; negative while it is valid

  /// Pressure is commanded, or may be in the next tick.
  bool pressurised() const {
    return mode == Mode::active || mode == Mode::hold || !input.fully_vented;
  }
  bool valves_silent() const {
    return settings.valve_readback && measurement_age_ns > thresholds.valve_silence_ns;
  }
};

struct Cause {
  CauseRule rule;
  bool (*present)(const Evidence&);
};

/// Every cause, the most severe first: an emergency stop, `shutdown` because it is final, then by
/// the mode they demand, then by what clears them: of two causes at once the stricter clearance
/// must not be forgotten. Valves that are silent or do not follow are a fault where there is
/// pressure; where there is none they only keep the arm from becoming active, so that valves may be
/// switched on after the daemon. So is an arm of another length, whose marker frames may still be
/// put right. Overruns are ticks missed in a row, and judged only under SCHED_FIFO
/// (consecutive_overruns is zero otherwise): without it they are only counted.
constexpr std::array kCauses{
    Cause{{Reason::emergency_stop, Mode::fault, Clearance::disarm_then_arm},
          [](const Evidence& e) { return e.input.requests.emergency_stop; }},
    Cause{{Reason::shutdown, Mode::vent, Clearance::never},
          [](const Evidence& e) { return e.input.requests.shutdown; }},
    Cause{{Reason::valves_silent, Mode::fault, Clearance::disarm_then_arm},
          [](const Evidence& e) { return e.valves_silent() && e.pressurised(); }},
    Cause{{Reason::pressure_mismatch, Mode::fault, Clearance::disarm_then_arm},
          [](const Evidence& e) { return e.input.pressure_mismatch && e.pressurised(); }},
    Cause{{Reason::curvature_mismatch, Mode::fault, Clearance::disarm_then_arm},
          [](const Evidence& e) { return e.input.curvature_mismatch; }},
    Cause{{Reason::wrong_model, Mode::fault, Clearance::disarm_then_arm},
          [](const Evidence& e) { return e.input.wrong_model; }},
    Cause{{Reason::length_mismatch, Mode::fault, Clearance::disarm_then_arm},
          [](const Evidence& e) { return e.input.length_mismatch && e.pressurised(); }},
    Cause{{Reason::disarmed, Mode::vent, Clearance::arm},
          [](const Evidence& e) { return e.input.requests.disarm; }},
    Cause{{Reason::deadman_released, Mode::vent, Clearance::arm},
          [](const Evidence& e) {
            return e.input.deadman_used && e.go_age_ns > e.thresholds.deadman_timeout_ns;
          }},
    Cause{{Reason::requests_lost, Mode::vent, Clearance::arm},
          [](const Evidence& e) { return e.input.requests.lost; }},
    Cause{{Reason::foreign_commands, Mode::vent, Clearance::arm},
          [](const Evidence& e) { return e.foreign_age_ns <= kForeign_ns; }},
    Cause{{Reason::soft_limit, Mode::vent, Clearance::arm},
          [](const Evidence& e) { return e.input.soft_limit_exceeded; }},
    Cause{{Reason::activated_too_often, Mode::vent, Clearance::arm},
          [](const Evidence& e) { return e.input.activated_too_often; }},
    Cause{{Reason::oscillation, Mode::vent, Clearance::arm},
          [](const Evidence& e) { return e.input.oscillation; }},
    Cause{{Reason::contact_vented, Mode::vent, Clearance::arm},
          [](const Evidence& e) { return e.input.contact_vents; }},
    Cause{{Reason::valves_silent, Mode::vent, Clearance::good_frames},
          [](const Evidence& e) { return e.valves_silent(); }},
    Cause{{Reason::pressure_mismatch, Mode::vent, Clearance::good_frames},
          [](const Evidence& e) { return e.input.pressure_mismatch; }},
    Cause{{Reason::length_mismatch, Mode::vent, Clearance::good_frames},
          [](const Evidence& e) { return e.input.length_mismatch; }},
    Cause{{Reason::time_gap, Mode::vent, Clearance::good_frames},
          [](const Evidence& e) {
            return e.input.paused || e.tick_gap_ns > e.thresholds.vent_after_ns;
          }},
    Cause{{Reason::command_expired, Mode::vent, Clearance::good_frames},
          [](const Evidence& e) { return e.input.command_expired; }},
    Cause{{Reason::sender_restarted, Mode::vent, Clearance::good_frames},
          [](const Evidence& e) { return e.input.sender_restarted; }},
    Cause{{Reason::frames_stale, Mode::vent, Clearance::good_frames},
          [](const Evidence& e) { return e.frame_age_ns > e.thresholds.vent_after_ns; }},
    Cause{{Reason::law_silent, Mode::vent, Clearance::good_frames},
          [](const Evidence& e) {
            return e.input.law_used && e.law_overdue_ns > e.thresholds.law_vent_after_ns;
          }},
    Cause{{Reason::frame_period_mismatch, Mode::vent, Clearance::good_frames},
          [](const Evidence& e) { return e.input.frame_period_mismatch; }},
    Cause{{Reason::many_overruns, Mode::vent, Clearance::good_frames},
          [](const Evidence& e) {
            return e.settings.vent_overruns > 0 &&
                   e.input.consecutive_overruns >= e.settings.vent_overruns;
          }},
    Cause{{Reason::frames_late, Mode::hold, Clearance::good_frames},
          [](const Evidence& e) {
            return e.input.motion_unknown || e.frame_age_ns > e.thresholds.hold_after_ns;
          }},
    Cause{{Reason::law_late, Mode::hold, Clearance::good_frames},
          [](const Evidence& e) { return e.input.law_used && e.law_overdue_ns > 0; }},
    Cause{{Reason::poses_frozen, Mode::hold, Clearance::good_frames},
          [](const Evidence& e) { return e.input.poses_frozen; }},
    Cause{{Reason::contact, Mode::hold, Clearance::good_frames},
          [](const Evidence& e) { return e.input.contact_holds; }},
    Cause{{Reason::overruns, Mode::hold, Clearance::good_frames},
          [](const Evidence& e) {
            return e.settings.hold_overruns > 0 &&
                   e.input.consecutive_overruns >= e.settings.hold_overruns;
          }},
};

/// Frames that come and are refused are late for another reason than those that do not come.
CauseRule named(CauseRule rule, const SafetyInput& input) noexcept {
  const bool by_age = rule.reason == Reason::frames_late || rule.reason == Reason::frames_stale;
  if (by_age && input.frames_refused) rule.reason = Reason::frames_refused;
  return rule;
}

/// What a vented arm waits for where no cause demands more.
Reason waiting_for_frames(const SafetyInput& input) {
  return input.frames_refused ? Reason::frames_refused : Reason::waiting_for_frames;
}

constexpr auto kRules = [] {
  std::array<CauseRule, kCauses.size()> rules{};
  for (std::size_t k = 0; k < rules.size(); ++k) rules[k] = kCauses[k].rule;
  return rules;
}();

/// The value may come from a message.
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
  constexpr std::array kNames{"none",
                              "starting",
                              "waiting_for_frames",
                              "waiting_for_arm",
                              "frames_late",
                              "poses_frozen",
                              "overruns",
                              "frames_stale",
                              "sender_restarted",
                              "soft_limit",
                              "time_gap",
                              "many_overruns",
                              "disarmed",
                              "shutdown",
                              "valves_silent",
                              "emergency_stop",
                              "deadman_released",
                              "pressure_mismatch",
                              "curvature_mismatch",
                              "command_expired",
                              "oscillation",
                              "length_mismatch",
                              "foreign_commands",
                              "requests_lost",
                              "frames_refused",
                              "frame_period_mismatch",
                              "activated_too_often",
                              "wrong_model",
                              "contact",
                              "contact_vented",
                              "law_late",
                              "law_silent"};
  static_assert(kNames.size() == static_cast<std::size_t>(kReasons));
  return name_of(reason, kNames);
}

std::span<const CauseRule> cause_table() noexcept { return kRules; }

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
  return {.hold_after_ns = to_ns(hold_s),
          .vent_after_ns = to_ns(vent_s),
          .valve_silence_ns = to_ns(settings.valve_silence_s),
          .deadman_timeout_ns = to_ns(settings.deadman_timeout_s),
          .law_vent_after_ns = to_ns(settings.law_vent_after_s),
          .arm_lapses_ns =
              to_ns(kArmLapses_s + 2.0 * settings.good_frames *
                                       std::max(settings.frame_period_s, control_period_s))};
}

SafetyMonitor::SafetyMonitor(const SafetySettings& settings, double control_period_s) noexcept
    : settings_(settings),
      thresholds_(resolve_thresholds(settings, control_period_s)),
      armed_(settings.arming == Arming::automatic) {}

/// LCM drops the newest messages when a queue is full: after a stop longer than valves may be
/// silent their newest measurement looks old although they never were. If no measurement has
/// arrived since the previous stop, another stop changes nothing.
void SafetyMonitor::note_stop(const SafetyInput& input) noexcept {
  if (mode_ == Mode::init) return;
  const std::int64_t stopped_ns = input.now_ns - previous_tick_ns_;
  if (stopped_ns > thresholds_.vent_after_ns || input.paused || input.command_expired)
    deaf_until_ns_ = input.now_ns + kStale_ns;
  if (stopped_ns > thresholds_.valve_silence_ns &&
      input.newest_measurement_ns > listening_since_ns_)
    listening_since_ns_ = input.now_ns;
}

CauseRule SafetyMonitor::worst_cause(const SafetyInput& input) const noexcept {
  const bool ticked_before = mode_ != Mode::init;
  const Evidence evidence{
      .input = input,
      .settings = settings_,
      .thresholds = thresholds_,
      .mode = mode_,
      .frame_age_ns = age_ns(input.now_ns, input.newest_capture_ns),
      .tick_gap_ns = ticked_before ? input.now_ns - previous_tick_ns_ : 0,
      .measurement_age_ns =
          input.newest_measurement_ns == kNever
              ? kForever
              : input.now_ns - std::max(input.newest_measurement_ns, listening_since_ns_),
      .go_age_ns = age_ns(input.now_ns, input.newest_go_ns),
      .foreign_age_ns = age_ns(input.now_ns, input.newest_foreign_ns),
      .law_overdue_ns = age_ns(input.now_ns, input.law_until_ns)};
  for (const Cause& cause : kCauses)
    if (cause.present(evidence)) return named(cause.rule, input);
  return {Reason::none, Mode::active, Clearance::good_frames};
}

void SafetyMonitor::take_operator_requests(const SafetyInput& input, Mode demanded) noexcept {
  // Arming applies to what the operator sees now. It is never kept until a cause is gone, and an
  // `arm` queued in the kernel while the daemon was stopped, which looks new, does not count. With
  // explicit arming one that does not lead to ACTIVE lapses: nobody expects the arm to move long
  // after a key press.
  const bool lapses = settings_.arming == Arming::explicit_ && !under_control();
  const bool hindered = demanded >= Mode::vent || (demanded == Mode::hold && lapses);
  if (input.requests.arm && !hindered && mode_ != Mode::fault && input.now_ns >= deaf_until_ns_) {
    if (!armed_ && lapses) arm_pending_since_ns_ = input.now_ns;
    armed_ = true;
  } else if (arm_pending_since_ns_ != kNever &&
             (hindered || input.now_ns - arm_pending_since_ns_ > thresholds_.arm_lapses_ns)) {
    armed_ = false;
  }
  // A request that was lost may have been one of these.
  if (input.requests.disarm || input.requests.shutdown || input.requests.lost) armed_ = false;
  if (!armed_) arm_pending_since_ns_ = kNever;
}

void SafetyMonitor::enter(const CauseRule& cause) noexcept {
  // With automatic arming the arm stays armed after a vent, unless it exceeded its limits (it would
  // do so again and again) or an operator disarmed it.
  if (cause.demands >= Mode::vent && cause.clearance != Clearance::good_frames) armed_ = false;
  mode_ = cause.demands;
  reason_ = cause.reason;
}

void SafetyMonitor::try_to_activate(const SafetyInput& input, Reason otherwise) noexcept {
  const bool vented_enough = mode_ == Mode::hold || input.fully_vented;
  if (!vented_enough) return;
  if (good_in_a_row_ < settings_.good_frames) {
    reason_ = otherwise;
  } else if (!armed_) {
    reason_ = Reason::waiting_for_arm;
  } else {
    mode_ = Mode::active;
    reason_ = Reason::none;
    arm_pending_since_ns_ = kNever;
  }
}

Mode SafetyMonitor::step(const SafetyInput& input) noexcept {
  note_stop(input);
  const CauseRule worst = worst_cause(input);
  take_operator_requests(input, worst.demands);
  // This applies in WAIT_FRAMES too, although such a cause does not change that mode.
  if (worst.demands >= Mode::vent && settings_.arming == Arming::explicit_) armed_ = false;
  previous_tick_ns_ = input.now_ns;
  if (mode_ == Mode::init) {
    mode_ = Mode::wait_frames;
    reason_ = Reason::waiting_for_frames;
  }

  // A run of good frames is one without a cause, a rejection, a gap or silent valves, and starts
  // again when the arm is vented (until then it is moving) and when queued messages have been
  // handled.
  const bool still_venting = mode_ >= Mode::vent && !input.fully_vented;
  const bool unheard = settings_.valve_readback && listening_since_ns_ != kNever &&
                       input.newest_measurement_ns <= listening_since_ns_;
  const bool deaf = input.now_ns < deaf_until_ns_;
  if (worst.demands > Mode::active || input.bad_frames > 0 || still_venting || unheard || deaf) {
    good_in_a_row_ = 0;
  } else {
    good_in_a_row_ = std::min(good_in_a_row_ + input.good_frames, settings_.good_frames);
  }

  switch (mode_) {
    case Mode::init:
    case Mode::wait_frames:
      if (worst.demands == Mode::fault || worst.clearance == Clearance::never) {
        enter(worst);
      } else {
        const bool by_frames = worst.demands < Mode::vent || worst.reason == Reason::frames_stale ||
                               worst.reason == Reason::frames_refused;
        try_to_activate(input, by_frames ? waiting_for_frames(input) : worst.reason);
      }
      break;
    case Mode::active:
    case Mode::hold:
      if (worst.demands > Mode::active) {
        enter(worst);
      } else if (mode_ == Mode::hold) {
        try_to_activate(input, reason_);
      }
      break;
    case Mode::vent:
      if (worst.demands >= Mode::vent) {
        enter(worst);
      } else if (reason_ != Reason::waiting_for_arm) {
        try_to_activate(input, reason_);
      } else {  // it would have been armed, but now something else is missing again
        try_to_activate(input,
                        worst.demands > Mode::active ? worst.reason : waiting_for_frames(input));
      }
      break;
    case Mode::fault:
      // Disarming acknowledges a fault whose cause has gone; the arm stays vented until it is armed
      // again. Nothing else leaves FAULT, the end of the daemon neither. An emergency stop is
      // reported even if a fault came before it.
      if (worst.reason == Reason::emergency_stop ||
          (input.requests.disarm && worst.demands < Mode::fault &&
           worst.clearance != Clearance::never))
        enter(worst);
      break;
  }
  return mode_;
}

}  // namespace softarm
