// Every reachable state of the valve guard together with a terminal that answers late, wrongly or
// not at all, lies about what it took, is written to by others, and holds its set points until its
// time-out. docs/explanation/safety_proof.md has the argument.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <deque>
#include <stdexcept>
#include <string>
#include <unordered_set>
#include <vector>

#include "milliseconds.hpp"
#include "softarm/valves/valve_guard.hpp"

namespace softarm {

/// All of the state of a guard, as numbers. A time is its distance from now, limited to the threshold
/// that it is compared with: beyond it all are alike. What is set again before it is used counts
/// only where it is used: without a connection, nothing of the one before.
struct ProofOfGuard {
  using Words = std::vector<std::int64_t>;

  static std::int64_t relative(std::int64_t time_ns, std::int64_t now_ns, std::int64_t limit_ns) {
    if (time_ns == kNever || time_ns == kForever) return time_ns;
    return std::clamp(time_ns - now_ns, -limit_ns, 20 * limit_ns);
  }
  static void add(Words& words, const Eigen::VectorXd& values) {
    for (const double value : values) words.push_back(std::bit_cast<std::int64_t>(value + 0.0));
  }
  static void add(Words& words, const ValveGuard& it, std::int64_t now_ns, std::int64_t number) {
    const bool connected = it.state_ > ValveState::securing;
    const bool known = connected && it.held_is_known_;
    struct Time {
      std::int64_t at_ns, limit_ns;
      bool used;
    };
    for (const Time& time :
         {Time{it.woken_ns_, it.failsafe_ns_, true},
          {it.next_attempt_ns_, it.period_ns_, it.state_ == ValveState::disconnected},
          {it.starting_since_ns_, it.period_ns_, it.state_ == ValveState::starting},
          {it.written_ns_, 2 * it.period_ns_, known},
          {it.listening_since_ns_, it.validity_ns_, it.must_see_zero_},
          {it.answered_ns_, it.failsafe_ns_, known},
          {it.venting_since_ns_, it.failsafe_ns_, connected},
          {it.failsafe_checked_ns_, 2 * it.period_ns_, connected},
          {it.expiry_.expires_ns_, it.validity_ns_, true},
          {it.expiry_.arrival_ns_, it.validity_ns_, !it.expiry_.vented()},
          {1000 * it.expiry_.sent_us_, it.validity_ns_, !it.expiry_.vented()}})
      words.push_back(time.used ? relative(time.at_ns, now_ns, time.limit_ns) : 0);
    for (const std::int64_t time_ns : it.off_since_ns_)
      words.push_back(connected ? relative(time_ns, now_ns, it.stuck_after_ns_ + it.period_ns_)
                                : 0);
    words.push_back(it.expiry_.vented() ? 0 : it.expiry_.sequence_ - number);
    words.push_back(it.backoff_ns_);
    for (const int value :
         {static_cast<int>(it.state_), connected ? static_cast<int>(it.reason_) : 0,
          it.state_ == ValveState::disconnected
              ? 0
              : std::min(it.failures_, it.settings_.driver.tolerated_failures + 1),
          connected ? it.good_cycles_ : 0})
      words.push_back(value);
    std::int64_t flags = 0;
    for (const bool flag : {connected && it.failsafe_lost_, connected && it.was_read_,
                            it.must_see_zero_, it.silence_is_zero_, it.rising_,
                            it.emergency_stopped_, it.stopping_, it.zero_confirmed_, known})
      flags = 2 * flags + (flag ? 1 : 0);
    words.push_back(flags);
    words.push_back(connected ? std::bit_cast<std::int64_t>(it.venting_from_bar_) : 0);
    add(words, it.set_points_bar_);
    add(words, it.expiry_.set_points_bar_);
    for (const Eigen::VectorXd* values :
         {&it.least_held_bar_, &it.most_held_bar_, &it.measured_bar_})
      if (known) add(words, *values);
  }
  /// Grows when a member is added that may be missing above.
  static constexpr std::size_t kSize = sizeof(ValveGuard);
};

namespace {

using test::kMs;
constexpr std::int64_t kEpoch = 1'000'000'000'000;
constexpr std::int64_t kPeriod = 500 * kMs, kFailsafe = 1500 * kMs, kValidity = 1000 * kMs;
constexpr double kFull_bar = 2.0, kRise_bar_per_s = 2.0;

ValveGuardSettings settings_of(bool waits_for_zero) {
  ValveGuardSettings settings;
  settings.driver.rate_hz = 2.0;
  settings.driver.tolerated_failures = 1;
  settings.driver.failsafe_timeout_s = 1e-9 * kFailsafe;
  settings.driver.backoff_s = settings.driver.longest_backoff_s = 0.1;
  settings.driver.stuck_after_s = 0.5;
  settings.max_pressure_bar = kFull_bar;
  settings.rise_bar_per_s = kRise_bar_per_s;
  settings.slew_bar_per_s = 2.0 * kRise_bar_per_s;
  settings.longest_validity_s = 1e-9 * kValidity;
  settings.wait_for_zero = waits_for_zero;
  return settings;
}

/// What one cycle may bring beside a command; only one of these at a time.
enum class Event {
  none,
  late,           // the driver runs again after twice its period,
  very_late,      // after longer than the terminal's time-out,
  paused,         // after a pause that its clock did not count, and in which the terminal vented
  late_write,     // between reading and writing
  no_connection,  // refused, or lost in any request
  read_lost,
  read_refused,
  not_ready,
  diagnosis,
  write_lost,   // with its answer,
  answer_lost,  // or only that
  write_refused,
  write_ignored,   // acknowledged all the same
  failsafe_wrong,  // another master changed the time-out, or it cannot be set
  foreign_write,   // another master wrote full pressure
  stuck,           // the pressure does not move
  stop,
  emergency_stop,  // an operator's,
  disarm,          // and what acknowledges it
  count
};
constexpr std::array<const char*, static_cast<std::size_t>(Event::count)> kEventNames = {
    "",
    "late",
    "very late",
    "paused",
    "late write",
    "no connection",
    "read lost",
    "read refused",
    "not ready",
    "diagnosis",
    "write lost",
    "answer lost",
    "write refused",
    "write ignored",
    "fail-safe wrong",
    "foreign write",
    "stuck",
    "stop",
    "emergency stop",
    "disarm"};

enum class Sent { nothing, zero, full, older, foreign, shadow, malformed, count };
constexpr std::array<const char*, static_cast<std::size_t>(Sent::count)> kSentNames = {
    "", "zero", "full", "older full", "foreign full", "shadow full", "malformed full"};

/// The terminal as documented: set points hold until nothing has been written for its time-out.
struct Terminal {
  bool has_echo = true;
  bool open = false;
  bool secured = false;  ///< its time-out is set
  double held_bar = 0.0, actual_bar = 0.0;
  std::int64_t fed_ns = 0;

  void pass(std::int64_t now_ns, bool follows) {
    if (secured && now_ns - fed_ns >= kFailsafe) held_bar = 0.0;
    if (follows) actual_bar = held_bar;
  }
};

/// What an onlooker knows of guard and terminal.
struct Onlooker {
  std::int64_t now_ns = kEpoch;
  std::int64_t right_ns = kNever;    ///< last time at which pressure was rightly written
  std::int64_t command_ns = kNever;  ///< arrival of the newest command of the sender
  double command_bar = 0.0;
  bool stopped = false;
  bool emergency = false;  ///< stopped by an operator, and not acknowledged
  bool own = true;         ///< what the terminal holds was written by the guard
};

struct State {
  ValveGuard guard;
  Terminal terminal;
  Onlooker seen;
};

struct Step {
  Event event = Event::none;
  Sent sent = Sent::nothing;
};

class Violation : public std::logic_error {
  using std::logic_error::logic_error;
};
void require(bool condition, const char* promise) {
  if (!condition) throw Violation(promise);
}

std::int64_t number_at(std::int64_t now_ns) { return now_ns / kPeriod; }

CommandVerdict send(State& state, Sent sent) {
  const std::int64_t now_ns = state.seen.now_ns;
  const double bar = sent == Sent::zero ? 0.0 : kFull_bar;
  PressureCommand command{.sequence = number_at(now_ns),
                          .validity_ns = kValidity,
                          .sent_us = now_ns / 1000,
                          .shadow = sent == Sent::shadow,
                          .pressure_bar = {&bar, 1}};
  if (sent == Sent::older) {
    command.sequence -= 1;
    command.sent_us -= kPeriod / 1000;
  }
  if (sent == Sent::foreign) command.sequence -= 1'000'000;
  if (sent == Sent::malformed) command.validity_ns = 0;
  return state.guard.command(command, now_ns);
}

/// The limits of what is written, and what it may be based on.
void judge_write(State& state, double before_bar, bool read, bool answered) {
  const Onlooker& seen = state.seen;
  const double bar = state.guard.set_points_bar()[0];
  require(bar >= 0.0 && bar <= kFull_bar, "set points are within their limits");
  if (state.guard.state() != ValveState::running)
    require(bar == 0.0, "only RUNNING writes pressure");
  if (bar == 0.0) return;
  require(!seen.stopped, "no pressure after a stop");
  require(!seen.emergency, "no pressure after an emergency stop");
  require(read && answered, "no pressure without a read-back in the same cycle");
  require(seen.command_ns != kNever && seen.now_ns - seen.command_ns < kValidity,
          "no pressure without a command that is valid");
  require(bar <= seen.command_bar, "no more pressure than commanded");
  require(bar - before_bar <= 2.0 * kRise_bar_per_s * 1e-9 * 2.0 * kPeriod + 1e-12,
          "no rise faster than the slew limit");
}

void exchange(State& state, Event event) {
  Terminal& terminal = state.terminal;
  const std::int64_t now_ns = state.seen.now_ns;
  const auto result = [&](Event lost, Event refused) {
    if (event == Event::no_connection) return LinkResult::broken;
    return event == lost      ? LinkResult::no_answer
           : event == refused ? LinkResult::exception_reply
                              : LinkResult::ok;
  };
  bool read = false;
  if (state.guard.may_read()) {
    ReadBack back(1);
    back.actual_bar[0] = terminal.actual_bar;
    back.has_echo = terminal.has_echo;
    back.echo_bar[0] = terminal.held_bar;
    back.ready = event != Event::not_ready;
    back.diagnosis[0] = event == Event::diagnosis;
    const LinkResult got = result(Event::read_lost, Event::read_refused);
    read = got == LinkResult::ok;
    const bool confirmed_before = state.guard.zero_confirmed();
    state.guard.measured(got, back, now_ns);
    if (state.guard.zero_confirmed() && !confirmed_before)
      require(terminal.actual_bar <= 0.1, "zero is confirmed by measured pressure");
  }
  bool answered = true;
  if (state.guard.failsafe_due(now_ns)) {
    if (event == Event::failsafe_wrong) terminal.secured = false;
    const LinkResult got = result(Event::read_lost, Event::read_refused);
    answered = got == LinkResult::ok;
    if (state.guard.failsafe_lost() && got == LinkResult::ok && event != Event::failsafe_wrong)
      terminal.secured = true;
    state.guard.failsafe_checked(got, terminal.secured, now_ns);
  }
  if (event == Event::late_write) {
    state.seen.now_ns += kFailsafe;
    terminal.pass(state.seen.now_ns, true);
  }
  state.guard.wake(state.seen.now_ns);
  if (state.guard.state() == ValveState::disconnected || !state.guard.may_write()) return;
  judge_write(state, terminal.held_bar, read, answered);
  const double bar = state.guard.set_points_bar()[0];
  const LinkResult wrote = event == Event::no_connection ? LinkResult::broken
                           : event == Event::write_lost || event == Event::answer_lost
                               ? LinkResult::no_answer
                           : event == Event::write_refused ? LinkResult::exception_reply
                                                           : LinkResult::ok;
  if (wrote == LinkResult::ok || event == Event::answer_lost) {
    terminal.fed_ns = state.seen.now_ns;
    if (event != Event::write_ignored) {
      terminal.held_bar = bar;
      state.seen.own = true;
    }
  } else if (wrote == LinkResult::exception_reply) {
    terminal.fed_ns = state.seen.now_ns;  // a terminal that any request keeps alive
  }
  if (bar > 0.0) state.seen.right_ns = state.seen.now_ns;
  state.guard.written(wrote, now_ns);
}

/// One cycle of the driver.
void step(State& state, const Step& input) {
  const Event event = input.event;
  Terminal& terminal = state.terminal;
  Onlooker& seen = state.seen;
  seen.now_ns += event == Event::late        ? 2 * kPeriod
                 : event == Event::very_late ? kFailsafe + kPeriod
                                             : kPeriod;
  if (event == Event::paused) terminal.fed_ns = kNever / 2;
  if (event == Event::foreign_write && terminal.open) {
    terminal.held_bar = kFull_bar;
    terminal.fed_ns = seen.now_ns;
    seen.own = false;
  }
  terminal.pass(seen.now_ns, event != Event::stuck);
  if (event == Event::stop) {
    state.guard.stop();
    seen.stopped = true;
  }
  if (event == Event::emergency_stop) {
    state.guard.emergency_stop();
    seen.emergency = true;
    require(state.guard.set_points_bar()[0] == 0.0, "an emergency stop vents at once");
  }
  if (event == Event::disarm) {
    state.guard.acknowledge();
    seen.emergency = false;
  }
  const bool listen = state.guard.wake(seen.now_ns, event == Event::paused);
  if (event == Event::paused) seen.command_ns = kNever;
  if (listen && input.sent != Sent::nothing) {
    const CommandVerdict verdict = send(state, input.sent);
    if (input.sent == Sent::shadow) require(verdict == CommandVerdict::shadow, "a shadow is none");
    if (input.sent == Sent::malformed)
      require(verdict == CommandVerdict::malformed, "a malformed command is refused");
    if (verdict == CommandVerdict::in_force) {
      seen.command_ns = seen.now_ns;
      seen.command_bar = input.sent == Sent::zero ? 0.0 : kFull_bar;
    }
    if (verdict == CommandVerdict::other_sender)
      require(state.guard.set_points_bar()[0] == 0.0, "two senders vent");
  }
  switch (state.guard.next(seen.now_ns)) {
    case ValveAction::wait:
      require(state.guard.state() == ValveState::disconnected, "only DISCONNECTED waits");
      break;
    case ValveAction::connect:
      require(!seen.stopped, "no connection after a stop");
      terminal.open = event != Event::no_connection;
      state.guard.connected(terminal.open, seen.now_ns);
      break;
    case ValveAction::secure: {
      const LinkResult got = event == Event::no_connection   ? LinkResult::broken
                             : event == Event::write_lost    ? LinkResult::no_answer
                             : event == Event::write_refused ? LinkResult::exception_reply
                                                             : LinkResult::ok;
      const bool as_written = got == LinkResult::ok && event != Event::failsafe_wrong;
      terminal.secured = terminal.secured || as_written;
      if (as_written) terminal.fed_ns = seen.now_ns;
      state.guard.secured(got, as_written, seen.now_ns);
      break;
    }
    case ValveAction::exchange:
      exchange(state, event);
      break;
  }
  if (state.guard.state() == ValveState::disconnected) terminal.open = false;
  if (seen.emergency && state.guard.state() == ValveState::degraded)
    require(state.guard.reason() == ValveReason::emergency_stop, "an emergency stop is named");
  // Whatever the terminal does with what is written, its pressure goes when the right to it has:
  // falling is given one time-out, silence one, and a cycle for each of noticing and doing.
  if (terminal.held_bar > 0.0 && terminal.secured && seen.own)
    require(seen.now_ns - seen.right_ns <= 2 * kFailsafe + kFailsafe / 2 + 4 * kPeriod,
            "pressure goes within its bound");
}

ProofOfGuard::Words words_of(const State& state) {
  ProofOfGuard::Words words;
  const Onlooker& seen = state.seen;
  ProofOfGuard::add(words, state.guard, seen.now_ns, number_at(seen.now_ns));
  const Terminal& terminal = state.terminal;
  words.push_back(terminal.held_bar > 0.0
                      ? ProofOfGuard::relative(terminal.fed_ns, seen.now_ns, kFailsafe)
                      : 0);
  words.push_back(terminal.held_bar > 0.0 && seen.own
                      ? ProofOfGuard::relative(seen.right_ns, seen.now_ns, 4 * kFailsafe)
                      : 0);
  words.push_back(seen.command_ns == kNever ? kNever
                                            : std::max(seen.command_ns - seen.now_ns, -kValidity));
  for (const double bar : {terminal.held_bar, terminal.actual_bar, seen.command_bar})
    words.push_back(std::bit_cast<std::int64_t>(bar));
  words.push_back((seen.emergency ? 16 : 0) + (terminal.open ? 8 : 0) + (terminal.secured ? 4 : 0) +
                  (seen.stopped ? 2 : 0) + (seen.own ? 1 : 0));
  return words;
}

struct Hash {
  std::size_t operator()(const ProofOfGuard::Words& words) const noexcept {
    std::uint64_t hash = 0;
    for (const std::int64_t word : words) {
      hash = (hash ^ static_cast<std::uint64_t>(word)) * 0x9e3779b97f4a7c15ULL;
      hash ^= hash >> 29;
    }
    return hash;
  }
};

struct Count {
  std::size_t states = 0, steps = 0;
};

class Exploration {
 public:
  Exploration(bool waits_for_zero, bool has_echo) : has_echo_(has_echo) {
    visits_.push_back(
        {{ValveGuard(settings_of(waits_for_zero)), {.has_echo = has_echo}, {}}, 0, {}});
    known_.insert(words_of(visits_[0].state));
  }

  Count run() {
    for (std::size_t k = 0; k < visits_.size(); ++k) {
      for (int event = 0; event < static_cast<int>(Event::count); ++event)
        for (const Sent sent : {Sent::nothing, Sent::zero, Sent::full})
          visit(k, {static_cast<Event>(event), sent});
      for (const Sent sent : {Sent::older, Sent::foreign, Sent::shadow, Sent::malformed})
        visit(k, {Event::none, sent});
      get_back(k);
    }
    count_.states = visits_.size();
    return count_;
  }

 private:
  struct Visit {
    State state;
    std::size_t from;
    Step step;
  };

  void visit(std::size_t index, const Step& input) {
    // What cannot be noticed without an echo, or only by a person.
    if (!has_echo_ && (input.event == Event::foreign_write || input.event == Event::write_ignored))
      return;
    State next = visits_[index].state;
    ++count_.steps;
    try {
      step(next, input);
    } catch (const Violation& violated) {
      throw std::runtime_error(violated.what() + way_to(index, input));
    }
    if (known_.insert(words_of(next)).second) visits_.push_back({std::move(next), index, input});
    if (visits_.size() > 500'000) throw std::runtime_error("states without end");
  }

  void get_back(std::size_t index) {
    State state = visits_[index].state;
    if (state.seen.stopped) return;
    const auto go = [&](Sent sent, int cycles) {
      for (int k = 0; k < cycles && state.guard.set_points_bar()[0] < kFull_bar; ++k) {
        step(state, {Event::none, sent});
        ++count_.steps;
      }
    };
    step(state, {Event::disarm, Sent::nothing});
    go(Sent::nothing, 40);
    go(Sent::zero, 10);
    go(Sent::full, 10);
    if (state.guard.set_points_bar()[0] != kFull_bar)
      throw std::runtime_error(
          "no way back from" + way_to(index, {}) +
          fmt::format(": {} ({})", name(state.guard.state()), name(state.guard.reason())));
  }

  std::string way_to(std::size_t index, const Step& last) const {
    std::vector<Step> way = {last};
    for (; index != 0; index = visits_[index].from) way.push_back(visits_[index].step);
    std::string text;
    State state = visits_[0].state;
    for (std::size_t k = way.size(); k-- > 0;) {
      try {
        step(state, way[k]);
      } catch (const Violation&) {
      }
      text +=
          fmt::format("\n  {} {} -> {} ({}) writes {} bar, held {} bar, measured {} bar",
                      kEventNames[static_cast<std::size_t>(way[k].event)],
                      kSentNames[static_cast<std::size_t>(way[k].sent)], name(state.guard.state()),
                      name(state.guard.reason()), state.guard.set_points_bar()[0],
                      state.terminal.held_bar, state.terminal.actual_bar);
    }
    return text;
  }

  bool has_echo_;
  std::deque<Visit> visits_;
  std::unordered_set<ProofOfGuard::Words, Hash> known_;
  Count count_;
};

TEST(GuardProof, EveryReachableStateKeepsEveryPromise) {
  Count sum;
  for (const bool waits_for_zero : {false, true}) {
    for (const bool has_echo : {true, false}) {
      Count count;
      ASSERT_NO_THROW(count = Exploration(waits_for_zero, has_echo).run());
      sum.states += count.states;
      sum.steps += count.steps;
    }
  }
  fmt::print("valve guard and terminal: {} states, {} steps\n", sum.states, sum.steps);
}

}  // namespace
}  // namespace softarm
