#include "softarm/valves/valve_guard.hpp"

#include <algorithm>
#include <cmath>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kShortestGap_ns = 50'000'000;
constexpr std::int64_t kMostStarting_ns = 20'000'000'000;  // a VTEM loads its motion app meanwhile
constexpr std::int64_t kMostExceptions_ns = 1'000'000'000;
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
                                    "shutdown"};
  return kNames[static_cast<int>(reason)];
}

ValveGuard::ValveGuard(const ValveGuardSettings& settings)
    : settings_(settings),
      period_ns_(to_ns(1.0 / settings.driver.rate_hz)),
      failsafe_ns_(to_ns(settings.driver.failsafe_timeout_s)),
      gap_ns_(std::min(std::max(5 * period_ns_, kShortestGap_ns), failsafe_ns_)),
      first_backoff_ns_(to_ns(settings.driver.backoff_s)),
      longest_backoff_ns_(to_ns(settings.driver.longest_backoff_s)),
      stuck_after_ns_(to_ns(settings.driver.stuck_after_s)),
      good_cycles_needed_(std::max(
          kStartCycles, static_cast<int>(std::ceil(kGoodFor_s * settings.driver.rate_hz)))),
      validity_ns_(to_ns(settings.longest_validity_s)),
      expiry_(settings.chambers, validity_ns_),
      backoff_ns_(first_backoff_ns_),
      must_see_zero_(settings.wait_for_zero),
      set_points_bar_(Eigen::VectorXd::Zero(settings.chambers)),
      off_since_ns_(static_cast<std::size_t>(settings.chambers), kNever) {}

void ValveGuard::enter(ValveState state, ValveReason reason) noexcept {
  state_ = state;
  reason_ = reason;
  if (state != ValveState::running) {
    set_points_bar_.setZero();
    rising_ = true;
  }
}

void ValveGuard::disconnect(ValveReason reason, std::int64_t now_ns) noexcept {
  if (settings_.wait_for_zero && (state_ == ValveState::running || state_ == ValveState::degraded))
    wait_for_zero();
  if (reason == ValveReason::failsafe_refused) backoff_ns_ = longest_backoff_ns_;
  next_attempt_ns_ = now_ns + backoff_ns_;
  backoff_ns_ = std::min(2 * backoff_ns_, longest_backoff_ns_);
  enter(ValveState::disconnected, reason);
}

void ValveGuard::degrade(ValveReason reason, int chamber) noexcept {
  // A stuck valve would be found only by raising the pressure again, so an operator has to look
  // first.
  if (settings_.wait_for_zero || reason == ValveReason::stuck_valve) wait_for_zero();
  if (state_ != ValveState::degraded) ++counters_.times_degraded;
  good_cycles_ = 0;
  chamber_ = chamber;
  enter(ValveState::degraded, reason);
}

bool ValveGuard::wake(std::int64_t now_ns) noexcept {
  bool gap = woken_ns_ != kNever && now_ns - woken_ns_ > gap_ns_;
  // The terminal has not answered for longer than its time-out, so it has vented by itself.
  gap |= state_ == ValveState::running && now_ns - answered_ns_ >= failsafe_ns_;
  woken_ns_ = now_ns;
  // Without a connection there is no pressure to lose, and connecting takes time.
  if (gap && (state_ == ValveState::running || state_ == ValveState::vented))
    degrade(ValveReason::time_gap, -1);
  return !gap;
}

ValveAction ValveGuard::next(std::int64_t now_ns) noexcept {
  expiry_.update(now_ns);
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

void ValveGuard::wait_for_zero() noexcept {
  must_see_zero_ = true;
  listening_since_ns_ = kNever;
}

void ValveGuard::update_running(std::int64_t now_ns) noexcept {
  const bool commanded = !expiry_.vented();
  if (listening_since_ns_ == kNever) listening_since_ns_ = now_ns;
  // Commands that could not be received do not count as silence of the controller.
  const bool silent = !commanded && now_ns - listening_since_ns_ >= validity_ns_;
  if (silent || (commanded && expiry_.set_points_bar().maxCoeff() <= 0.0)) must_see_zero_ = false;
  if (state_ != ValveState::vented && state_ != ValveState::running) return;
  if (stopping_) {
    enter(ValveState::vented, ValveReason::shutdown);
  } else if (!commanded) {
    enter(ValveState::vented, ValveReason::no_command);
  } else if (state_ == ValveState::vented) {
    if (must_see_zero_) {
      enter(ValveState::vented, ValveReason::waiting_for_zero);
    } else {
      enter(ValveState::running, ValveReason::none);
    }
  }
}

void ValveGuard::update_set_points(std::int64_t now_ns) noexcept {
  const double passed_s =
      written_ns_ == kNever ? 0.0 : to_seconds(std::min(now_ns - written_ns_, 2 * period_ns_));
  written_ns_ = now_ns;
  if (state_ != ValveState::running) return;
  const double rise_bar =
      rising_ ? settings_.rise_bar_per_s * passed_s : settings_.max_pressure_bar;
  bool reached = true;
  for (Eigen::Index i = 0; i < set_points_bar_.size(); ++i) {
    const double wanted = std::clamp(expiry_.set_points_bar()[i], 0.0, settings_.max_pressure_bar);
    reached = reached && wanted <= set_points_bar_[i] + rise_bar;
    set_points_bar_[i] = std::min(wanted, set_points_bar_[i] + rise_bar);
  }
  rising_ = rising_ && !reached;
}

void ValveGuard::connected(bool success, std::int64_t now_ns) noexcept {
  if (!success) return disconnect(ValveReason::no_connection, now_ns);
  ++counters_.connections;
  failures_ = 0;
  good_cycles_ = 0;
  enter(ValveState::securing, ValveReason::none);
}

void ValveGuard::secured(LinkResult result, bool as_written, std::int64_t now_ns) noexcept {
  if (result == LinkResult::ok && as_written) {
    failures_ = 0;
    starting_since_ns_ = now_ns;
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
  // It may have been written even if the answer is missing.
  if (set_points_bar_.maxCoeff() > 0.0) zero_confirmed_ = false;
  counters_.exceptions += result == LinkResult::exception_reply;
  counters_.no_answers += result == LinkResult::no_answer;
  counters_.broken += result == LinkResult::broken;
  if (result == LinkResult::broken) return disconnect(ValveReason::no_connection, now_ns);
  good_cycles_ = 0;
  if (failures_++ == 0) failing_since_ns_ = now_ns;
  if (failures_ <= settings_.driver.tolerated_failures) return;
  if (result == LinkResult::no_answer) return disconnect(ValveReason::no_answer, now_ns);
  // It answers, so zero may still reach it; a terminal that refuses zero too vents by its own
  // time-out.
  if (now_ns - failing_since_ns_ > kMostExceptions_ns)
    return disconnect(ValveReason::exception_reply, now_ns);
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

int ValveGuard::stuck_chamber(const ReadBack& read_back, std::int64_t now_ns) noexcept {
  int stuck = -1;
  for (std::size_t i = 0; i < off_since_ns_.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    double off_bar = std::abs(read_back.actual_bar[at] - set_points_bar_[at]);
    if (read_back.has_echo)
      off_bar = std::max(off_bar, std::abs(read_back.echo_bar[at] - set_points_bar_[at]));
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

void ValveGuard::exchanged(LinkResult result, const ReadBack& read_back,
                           std::int64_t now_ns) noexcept {
  if (result != LinkResult::ok) return failed(result, now_ns);
  ++counters_.cycles;
  answered_ns_ = now_ns;
  failures_ = 0;
  const bool zero = set_points_bar_.maxCoeff() <= 0.0;
  zero_confirmed_ = zero && (!read_back.has_echo ||
                             read_back.echo_bar.cwiseAbs().maxCoeff() <= read_back.resolution_bar);

  int chamber = -1;
  ValveReason wrong = fault(read_back, chamber);
  const int stuck = stuck_chamber(read_back, now_ns);
  if (wrong == ValveReason::none && stuck >= 0 && settings_.driver.stuck_vents) {
    wrong = ValveReason::stuck_valve;
    chamber = stuck;
  }
  if (state_ == ValveState::starting) {
    chamber_ = chamber;
    if (wrong != ValveReason::none && wrong != ValveReason::stuck_valve) {
      reason_ = wrong;
      good_cycles_ = 0;
      if (now_ns - starting_since_ns_ > kMostStarting_ns) disconnect(wrong, now_ns);
    } else if (++good_cycles_ >= kStartCycles) {
      backoff_ns_ = first_backoff_ns_;
      enter(ValveState::vented, stopping_ ? ValveReason::shutdown : ValveReason::no_command);
    }
    return;
  }
  if (wrong != ValveReason::none) return degrade(wrong, chamber);
  if (state_ != ValveState::degraded) {
    chamber_ = stuck;  // if stuck valves are only reported
    return;
  }
  // A valve that was stuck has to follow again before it counts as good.
  const bool follows = std::all_of(off_since_ns_.begin(), off_since_ns_.end(),
                                   [](std::int64_t since) { return since == kNever; });
  good_cycles_ = follows || reason_ != ValveReason::stuck_valve ? good_cycles_ + 1 : 0;
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
