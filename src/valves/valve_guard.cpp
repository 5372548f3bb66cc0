#include "softarm/valves/valve_guard.hpp"

#include <algorithm>
#include <cmath>

#include "softarm/actuation/pressure_ramps.hpp"
#include "softarm/base/time.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kShortestGap_ns = 50'000'000;
constexpr std::int64_t kMostStarting_ns = 20'000'000'000;  // a VTEM loads its motion app meanwhile
constexpr std::int64_t kFailsafeCheck_ns = 1'000'000'000;
constexpr double kGoodFor_s = 0.25;
constexpr int kStartCycles = 3;

}  // namespace

const char* name(ValveState state) noexcept {
  constexpr const char* kNames[] = {"DISCONNECTED", "SECURING", "STARTING",
                                    "VENTED",       "RUNNING",  "DEGRADED"};
  return kNames[static_cast<int>(state)];
}

const char* name(ValveReason reason) noexcept {
  constexpr const char* kNames[] = {"",
                                    "no command in force",
                                    "no connection",
                                    "no answer in time",
                                    "exception reply",
                                    "fail-safe time-out refused",
                                    "not ready",
                                    "diagnosis",
                                    "stuck valve",
                                    "time gap",
                                    "waiting for commands of zero",
                                    "shutdown",
                                    "another sender",
                                    "set points not as written",
                                    "fail-safe time-out changed",
                                    "pressure does not fall",
                                    "emergency stop"};
  return kNames[static_cast<int>(reason)];
}

ValveGuard::ValveGuard(const ValveGuardSettings& settings)
    : settings_(settings),
      period_ns_(to_ns(1.0 / settings.driver.rate_hz)),
      failsafe_ns_(to_ns(settings.driver.failsafe_timeout_s)),
      gap_ns_(std::min(std::max(5 * period_ns_, kShortestGap_ns), failsafe_ns_)),
      // Longer than the terminal's time-out, so that every silence vents it.
      first_backoff_ns_(std::max(
          to_ns(settings.driver.backoff_s),
          3 * std::max(failsafe_ns_, to_ns(settings.driver.registers.timeout_least_s)) / 2 +
              4 * period_ns_)),
      longest_backoff_ns_(std::max(to_ns(settings.driver.longest_backoff_s), first_backoff_ns_)),
      stuck_after_ns_(to_ns(settings.driver.stuck_after_s)),
      good_cycles_needed_(std::max(
          kStartCycles, static_cast<int>(std::ceil(kGoodFor_s * settings.driver.rate_hz)))),
      validity_ns_(to_ns(settings.longest_validity_s)),
      expiry_(settings.chambers, validity_ns_),
      backoff_ns_(first_backoff_ns_),
      must_see_zero_(settings.wait_for_zero),
      set_points_bar_(Eigen::VectorXd::Zero(settings.chambers)),
      least_held_bar_(set_points_bar_),
      most_held_bar_(set_points_bar_),
      measured_bar_(set_points_bar_),
      off_since_ns_(static_cast<std::size_t>(settings.chambers), kNever) {}

void ValveGuard::enter(ValveState state, ValveReason reason) noexcept {
  if (state_ == ValveState::running && state != ValveState::running) ++counters_.times_vented;
  state_ = state;
  reason_ = reason;
  if (state != ValveState::running) {
    set_points_bar_.setZero();
    rising_ = true;
  }
}

void ValveGuard::disconnect(ValveReason reason, std::int64_t now_ns) noexcept {
  const bool was_running = state_ == ValveState::running || state_ == ValveState::degraded;
  if ((settings_.wait_for_zero && was_running) || reason == ValveReason::zero_unconfirmed)
    wait_for_zero(true);
  if (reason == ValveReason::failsafe_refused) backoff_ns_ = longest_backoff_ns_;
  next_attempt_ns_ = now_ns + backoff_ns_;
  backoff_ns_ = std::min(2 * backoff_ns_, longest_backoff_ns_);
  enter(ValveState::disconnected, reason);
}

void ValveGuard::degrade(ValveReason reason, int chamber) noexcept {
  if (emergency_stopped_) {  // whatever else is wrong
    reason = ValveReason::emergency_stop;
    chamber = -1;
  }
  // A stuck valve would be found only by raising the pressure again, and of two senders one has to
  // leave, so an operator has to look first.
  if (settings_.wait_for_zero || reason == ValveReason::stuck_valve ||
      reason == ValveReason::other_sender || reason == ValveReason::emergency_stop)
    wait_for_zero(true);
  if (state_ != ValveState::degraded) ++counters_.times_degraded;
  good_cycles_ = 0;
  chamber_ = chamber;
  enter(ValveState::degraded, reason);
}

bool ValveGuard::wake(std::int64_t now_ns, bool paused) noexcept {
  const std::int64_t slept_ns = woken_ns_ == kNever ? 0 : now_ns - woken_ns_;
  bool gap = paused || slept_ns > gap_ns_;
  if (slept_ns >= failsafe_ns_) venting_since_ns_ = now_ns;  // that was a silence of ours
  // The terminal has not answered for longer than its time-out, so it has vented by itself.
  gap |= state_ == ValveState::running && now_ns - answered_ns_ >= failsafe_ns_;
  woken_ns_ = now_ns;
  if (paused) expiry_.vent();  // its validity did not pass while the clock stood still
  // Without a connection there is no pressure to lose, and connecting takes time.
  if (gap && (state_ == ValveState::running || state_ == ValveState::vented))
    degrade(ValveReason::time_gap, -1);
  return !gap;
}

CommandVerdict ValveGuard::command(const PressureCommand& command,
                                   std::int64_t arrival_ns) noexcept {
  const CommandVerdict verdict = expiry_.receive(command, arrival_ns);
  if (verdict != CommandVerdict::other_sender) return verdict;
  ++counters_.other_senders;
  // A terminal becomes ready all the same, so that the state can name the reason; and a stuck valve
  // stays one.
  const bool named = state_ >= ValveState::vented && reason_ != ValveReason::stuck_valve;
  if (named) {
    degrade(ValveReason::other_sender, -1);
  } else {
    wait_for_zero(true);
  }
  if (state_ == ValveState::degraded) good_cycles_ = 0;
  return verdict;
}

void ValveGuard::emergency_stop() noexcept {
  emergency_stopped_ = true;
  expiry_.vent();
  if (state_ >= ValveState::vented) degrade(ValveReason::emergency_stop, -1);
}

ValveAction ValveGuard::next(std::int64_t now_ns) noexcept {
  const bool expired = expiry_.update(now_ns);
  if (expired && settings_.wait_for_zero && set_points_bar_.maxCoeff() > 0.0) wait_for_zero(false);
  if (exchanging() && state_ != ValveState::running && now_ns - venting_since_ns_ >= failsafe_ns_)
    disconnect(ValveReason::zero_unconfirmed, now_ns);
  switch (state_) {
    case ValveState::disconnected:
      return !stopping_ && now_ns >= next_attempt_ns_ ? ValveAction::connect : ValveAction::wait;
    case ValveState::securing:
      return ValveAction::secure;
    default:
      update_running(now_ns);
      update_set_points(now_ns);
      return ValveAction::exchange;
  }
}

void ValveGuard::wait_for_zero(bool or_silence) noexcept {
  silence_is_zero_ = or_silence && (silence_is_zero_ || !must_see_zero_);
  must_see_zero_ = true;
  listening_since_ns_ = kNever;
}

void ValveGuard::update_running(std::int64_t now_ns) noexcept {
  const bool commanded = !expiry_.vented();
  if (listening_since_ns_ == kNever) listening_since_ns_ = now_ns;
  // Commands that could not be received do not count as silence of the controller.
  const bool silent =
      silence_is_zero_ && !commanded && now_ns - listening_since_ns_ >= validity_ns_;
  if (silent || (commanded && expiry_.set_points_bar().maxCoeff() <= 0.0)) {
    must_see_zero_ = false;
    silence_is_zero_ = true;
  }
  if (state_ == ValveState::running) {
    venting_since_ns_ = now_ns;
    venting_from_bar_ = measured_bar_.maxCoeff();
  }
  if (state_ != ValveState::vented && state_ != ValveState::running) return;
  if (emergency_stopped_) return degrade(ValveReason::emergency_stop, -1);
  if (stopping_) {
    enter(ValveState::vented, ValveReason::shutdown);
  } else if (!commanded) {
    enter(ValveState::vented, must_see_zero_ && !silence_is_zero_ ? ValveReason::waiting_for_zero
                                                                  : ValveReason::no_command);
  } else if (state_ == ValveState::vented) {
    if (must_see_zero_) {
      enter(ValveState::vented, ValveReason::waiting_for_zero);
    } else {
      enter(ValveState::running, ValveReason::none);
    }
  }
}

void ValveGuard::update_set_points(std::int64_t now_ns) noexcept {
  if (state_ != ValveState::running) return;
  const double passed_s = to_seconds(std::min(now_ns - written_ns_, 2 * period_ns_));
  // No sender is trusted to keep the slew limit; from vented on, rise more gently.
  const double rate = rising_ ? std::min(settings_.rise_bar_per_s, settings_.slew_bar_per_s)
                              : settings_.slew_bar_per_s;
  bool reached = true;
  for (Eigen::Index i = 0; i < set_points_bar_.size(); ++i) {
    const double wanted = std::clamp(expiry_.set_points_bar()[i], 0.0, settings_.max_pressure_bar);
    set_points_bar_[i] = rise_towards(least_held_bar_[i], wanted, rate * passed_s);
    reached = reached && set_points_bar_[i] == wanted;
  }
  rising_ = rising_ && !reached;
}

void ValveGuard::connected(bool success, std::int64_t now_ns) noexcept {
  if (!success) return disconnect(ValveReason::no_connection, now_ns);
  ++counters_.connections;
  failures_ = 0;
  good_cycles_ = 0;
  held_is_known_ = was_read_ = false;
  zero_confirmed_ = false;  // its pressures are not known
  enter(ValveState::securing, ValveReason::none);
}

void ValveGuard::secured(LinkResult result, bool as_written, std::int64_t now_ns) noexcept {
  if (result == LinkResult::ok && as_written) {
    failures_ = 0;
    starting_since_ns_ = venting_since_ns_ = failsafe_checked_ns_ = now_ns;
    venting_from_bar_ = 0.0;
    failsafe_lost_ = false;
    std::fill(off_since_ns_.begin(), off_since_ns_.end(), kNever);
    return enter(ValveState::starting, ValveReason::not_ready);
  }
  counters_.exceptions += result == LinkResult::exception_reply;
  counters_.no_answers += result == LinkResult::no_answer;
  counters_.broken += result == LinkResult::broken;
  if (result == LinkResult::no_answer && ++failures_ <= settings_.driver.tolerated_failures) return;
  disconnect(result == LinkResult::no_answer ? ValveReason::no_answer
             : result == LinkResult::broken  ? ValveReason::no_connection
                                             : ValveReason::failsafe_refused,
             now_ns);
}

void ValveGuard::failed(LinkResult result, std::int64_t now_ns) noexcept {
  counters_.exceptions += result == LinkResult::exception_reply;
  counters_.no_answers += result == LinkResult::no_answer;
  counters_.broken += result == LinkResult::broken;
  if (result == LinkResult::broken) return disconnect(ValveReason::no_connection, now_ns);
  good_cycles_ = 0;
  ++failures_;
  if (failures_ <= settings_.driver.tolerated_failures) return;
  if (result == LinkResult::no_answer) return disconnect(ValveReason::no_answer, now_ns);
  // It answers, so zero may still reach it, and is offered as long as pressures fall.
  degrade(ValveReason::exception_reply, -1);
}

ValveReason ValveGuard::fault(const ReadBack& read_back, int& chamber) const noexcept {
  for (std::size_t i = 0; i < read_back.diagnosis.size(); ++i) {
    if (read_back.diagnosis[i] == 0) continue;
    chamber = static_cast<int>(i);
    return ValveReason::diagnosis;
  }
  return read_back.ready ? ValveReason::none : ValveReason::not_ready;
}

/// The first chamber whose set point in the terminal is none that was written; -1: none.
int ValveGuard::mismatch(const ReadBack& read_back) const noexcept {
  if (!held_is_known_ || !read_back.has_echo) return -1;
  for (Eigen::Index i = 0; i < set_points_bar_.size(); ++i) {
    const double echo = read_back.echo_bar[i];
    if (echo < least_held_bar_[i] - read_back.resolution_bar ||
        echo > most_held_bar_[i] + read_back.resolution_bar)
      return static_cast<int>(i);
  }
  return -1;
}

/// Where set points cannot be read back: the first chamber whose pressure has dropped within one
/// cycle although its set point has not. No arm vents so fast, so time has passed; -1: none.
int ValveGuard::fallen_chamber(const ReadBack& read_back) noexcept {
  if (!held_is_known_ || read_back.has_echo || !was_read_ || state_ != ValveState::running)
    return -1;
  for (Eigen::Index i = 0; i < set_points_bar_.size(); ++i) {
    const double limit_bar = std::min(measured_bar_[i], least_held_bar_[i]);
    if (read_back.actual_bar[i] < limit_bar - settings_.driver.stuck_bar)
      return static_cast<int>(i);
  }
  return -1;
}

int ValveGuard::stuck_chamber(const ReadBack& read_back, std::int64_t now_ns) noexcept {
  int stuck = -1;
  for (std::size_t i = 0; i < off_since_ns_.size() && held_is_known_; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double actual = read_back.actual_bar[at];
    const double off_bar = std::max(actual - most_held_bar_[at], least_held_bar_[at] - actual);
    if (off_bar <= settings_.driver.stuck_bar) {
      off_since_ns_[i] = kNever;
    } else if (off_since_ns_[i] == kNever) {
      off_since_ns_[i] = now_ns;
    } else if (now_ns - off_since_ns_[i] > stuck_after_ns_ && stuck < 0) {
      stuck = static_cast<int>(i);
    }
  }
  return stuck;
}

/// Whether zero has arrived at the valves, and whether pressures are on their way there.
void ValveGuard::note_venting(const ReadBack& read_back, std::int64_t now_ns) noexcept {
  measured_bar_ = read_back.actual_bar;
  const double highest_bar = measured_bar_.maxCoeff();
  const bool holds_zero =
      held_is_known_ && most_held_bar_.maxCoeff() <= 0.0 &&
      (!read_back.has_echo || read_back.echo_bar.cwiseAbs().maxCoeff() <= read_back.resolution_bar);
  zero_confirmed_ = holds_zero && highest_bar <= settings_.driver.vented_bar;
  if (highest_bar > settings_.driver.vented_bar && 2.0 * highest_bar > venting_from_bar_) {
    venting_from_bar_ = std::max(venting_from_bar_, highest_bar);
    return;
  }
  venting_from_bar_ = highest_bar;
  venting_since_ns_ = now_ns;
}

void ValveGuard::measured(LinkResult result, const ReadBack& read_back,
                          std::int64_t now_ns) noexcept {
  is_good_ = false;
  if (result != LinkResult::ok) {
    was_read_ = false;
    return failed(result, now_ns);
  }
  int chamber = -1;
  ValveReason wrong = fault(read_back, chamber);
  const int stuck = stuck_chamber(read_back, now_ns);
  if (wrong == ValveReason::none && stuck >= 0 && settings_.driver.stuck_vents) {
    wrong = ValveReason::stuck_valve;
    chamber = stuck;
  }
  if (const int fallen = fallen_chamber(read_back); fallen >= 0) {
    wrong = ValveReason::time_gap;
    chamber = fallen;
  }
  if (const int other = mismatch(read_back); other >= 0) {
    wrong = ValveReason::echo_mismatch;
    chamber = other;
  }
  note_venting(read_back, now_ns);
  was_read_ = true;
  if (state_ == ValveState::starting) {
    chamber_ = chamber;
    is_good_ = wrong == ValveReason::none || wrong == ValveReason::stuck_valve;
    if (is_good_) return;
    reason_ = wrong;
    good_cycles_ = 0;
    if (now_ns - starting_since_ns_ > kMostStarting_ns) disconnect(wrong, now_ns);
    return;
  }
  if (wrong != ValveReason::none) return degrade(wrong, chamber);
  if (state_ != ValveState::degraded) chamber_ = stuck;  // if stuck valves are only reported
  is_good_ = true;
}

bool ValveGuard::failsafe_due(std::int64_t now_ns) const noexcept {
  return exchanging() && was_read_ &&
         (failsafe_lost_ || now_ns - failsafe_checked_ns_ >= kFailsafeCheck_ns);
}

void ValveGuard::failsafe_checked(LinkResult result, bool as_set, std::int64_t now_ns) noexcept {
  if (result == LinkResult::ok && as_set) {
    failsafe_checked_ns_ = now_ns;
    failsafe_lost_ = false;
    return;
  }
  was_read_ = is_good_ = false;  // no pressure in this cycle
  if (result != LinkResult::ok) return failed(result, now_ns);
  if (failsafe_lost_) return disconnect(ValveReason::failsafe_refused, now_ns);
  failsafe_lost_ = true;
  degrade(ValveReason::failsafe_changed, -1);
}

bool ValveGuard::may_write() const noexcept {
  return exchanging() && (was_read_ || state_ != ValveState::running);
}

void ValveGuard::written(LinkResult result, std::int64_t now_ns) noexcept {
  written_ns_ = now_ns;
  if (set_points_bar_.maxCoeff() > 0.0) zero_confirmed_ = false;
  if (result != LinkResult::ok) {
    // It may have arrived even if the answer is missing.
    least_held_bar_ = least_held_bar_.cwiseMin(set_points_bar_);
    most_held_bar_ = most_held_bar_.cwiseMax(set_points_bar_);
    if (was_read_) failed(result, now_ns);  // one failure a cycle
    return;
  }
  least_held_bar_ = most_held_bar_ = set_points_bar_;
  held_is_known_ = true;
  if (!was_read_) return;
  ++counters_.cycles;
  answered_ns_ = now_ns;
  failures_ = 0;
  if (is_good_) note_good_cycle();
}

void ValveGuard::note_good_cycle() noexcept {
  if (state_ == ValveState::starting) {
    good_cycles_ = zero_confirmed_ ? good_cycles_ + 1 : 0;
    if (good_cycles_ < kStartCycles) return;
    backoff_ns_ = first_backoff_ns_;
    enter(ValveState::vented, stopping_ ? ValveReason::shutdown : ValveReason::no_command);
  }
  if (state_ != ValveState::degraded) return;
  // A valve that was stuck has to follow again before it counts as good.
  const bool follows = std::all_of(off_since_ns_.begin(), off_since_ns_.end(),
                                   [](std::int64_t since) { return since == kNever; });
  const bool good = zero_confirmed_ && !failsafe_lost_ && !emergency_stopped_ &&
                    (follows || reason_ != ValveReason::stuck_valve);
  good_cycles_ = good ? good_cycles_ + 1 : 0;
  if (good_cycles_ < good_cycles_needed_) return;
  chamber_ = -1;
  enter(ValveState::vented, ValveReason::no_command);
}

void ValveGuard::stop() noexcept {
  stopping_ = true;
  if (state_ == ValveState::running) enter(ValveState::vented, ValveReason::shutdown);
  if (state_ == ValveState::vented) reason_ = ValveReason::shutdown;
}

}  // namespace softarm
