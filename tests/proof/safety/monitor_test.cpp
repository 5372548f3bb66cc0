// Every reachable state of the safety monitor, against what its documentation promises.
// docs/explanation/safety_proof.md: why steps of time around the thresholds, pairs of causes and
// two good frames suffice.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <bitset>
#include <stdexcept>
#include <string>
#include <vector>

#include "milliseconds.hpp"
#include "proof/safety/explorer.hpp"
#include "softarm/runtime/safety_monitor.hpp"

namespace softarm {
namespace {

using proof::kEpoch_ns;

using test::kMs;
constexpr double kPeriod_s = 0.125;  // an `arm` lapses after 2.5 s with it
/// All times are multiples of this, so that ages take few values, each threshold itself among them.
constexpr std::int64_t kStep = 500 * kMs;
constexpr std::int64_t kHold = kStep, kVent = 2 * kStep, kSilence = kStep, kDeadman = kStep,
                       kDeaf = kStep, kForeign = 2 * kStep, kLawVent = kStep;
constexpr int kHoldOverruns = 2, kVentOverruns = 4, kGoodFrames = 2;
/// From one tick to the next: at the threshold of silence, at that of a stop, and beyond it.
constexpr std::array kGaps = {kSilence, kVent, kVent + kStep};

/// An input that raises a cause. Two that write the same member exclude each other.
struct Trigger {
  Reason reason;
  int member;
  void (*raise)(SafetyInput&);
};

/// Each cause, with the least and with the usual input that raises it. A new cause needs its lines
/// here; `EveryCauseHasItsTrigger` names it. valves_silent and time_gap follow from the times too.
const std::vector<Trigger> kTriggers = {
    {Reason::shutdown, 0, [](SafetyInput& in) { in.requests.shutdown = true; }},
    {Reason::emergency_stop, 1, [](SafetyInput& in) { in.requests.emergency_stop = true; }},
    {Reason::disarmed, 2, [](SafetyInput& in) { in.requests.disarm = true; }},
    {Reason::pressure_mismatch, 3, [](SafetyInput& in) { in.pressure_mismatch = true; }},
    {Reason::curvature_mismatch, 4, [](SafetyInput& in) { in.curvature_mismatch = true; }},
    {Reason::length_mismatch, 13, [](SafetyInput& in) { in.length_mismatch = true; }},
    {Reason::wrong_model, 22, [](SafetyInput& in) { in.wrong_model = true; }},
    {Reason::contact_vented, 23, [](SafetyInput& in) { in.contact_vents = true; }},
    {Reason::contact, 24, [](SafetyInput& in) { in.contact_holds = true; }},
    {Reason::deadman_released, 5,
     [](SafetyInput& in) { in.newest_go_ns = in.now_ns - kDeadman - kStep; }},
    {Reason::deadman_released, 5, [](SafetyInput& in) { in.newest_go_ns = kNever; }},
    {Reason::requests_lost, 15, [](SafetyInput& in) { in.requests.lost = true; }},
    {Reason::foreign_commands, 16,
     [](SafetyInput& in) { in.newest_foreign_ns = in.now_ns - kForeign; }},
    {Reason::oscillation, 17, [](SafetyInput& in) { in.oscillation = true; }},
    {Reason::time_gap, 14, [](SafetyInput& in) { in.paused = true; }},
    {Reason::command_expired, 6, [](SafetyInput& in) { in.command_expired = true; }},
    {Reason::sender_restarted, 7, [](SafetyInput& in) { in.sender_restarted = true; }},
    {Reason::frames_stale, 8,
     [](SafetyInput& in) { in.newest_capture_ns = in.now_ns - kVent - kStep; }},
    {Reason::frames_stale, 8, [](SafetyInput& in) { in.newest_capture_ns = kNever; }},
    {Reason::soft_limit, 9, [](SafetyInput& in) { in.soft_limit_exceeded = true; }},
    {Reason::many_overruns, 10, [](SafetyInput& in) { in.consecutive_overruns = kVentOverruns; }},
    {Reason::frames_late, 8,
     [](SafetyInput& in) { in.newest_capture_ns = in.now_ns - kHold - kStep; }},
    {Reason::frames_late, 11, [](SafetyInput& in) { in.motion_unknown = true; }},
    {Reason::poses_frozen, 12, [](SafetyInput& in) { in.poses_frozen = true; }},
    {Reason::frame_period_mismatch, 20, [](SafetyInput& in) { in.frame_period_mismatch = true; }},
    {Reason::activated_too_often, 21, [](SafetyInput& in) { in.activated_too_often = true; }},
    {Reason::law_silent, 22,
     [](SafetyInput& in) { in.law_until_ns = in.now_ns - kLawVent - kStep; }},
    {Reason::law_silent, 22, [](SafetyInput& in) { in.law_until_ns = kNever; }},
    {Reason::law_late, 22, [](SafetyInput& in) { in.law_until_ns = in.now_ns - kLawVent; }},
    {Reason::overruns, 10, [](SafetyInput& in) { in.consecutive_overruns = kHoldOverruns; }},
    {Reason::overruns, 10, [](SafetyInput& in) { in.consecutive_overruns = kVentOverruns - 1; }},
};

/// No cause, but every age and count at its threshold.
SafetyInput healthy(std::int64_t now_ns) {
  SafetyInput in;
  in.now_ns = now_ns;
  in.newest_capture_ns = now_ns - kHold;
  in.newest_measurement_ns = now_ns;
  in.newest_go_ns = now_ns - kDeadman;
  in.newest_foreign_ns = now_ns - kForeign - kStep;
  in.law_until_ns = now_ns;
  in.consecutive_overruns = kHoldOverruns - 1;
  return in;
}

struct Setup {
  Arming arming;
  bool watches;  ///< everything that can be switched off is on
};

SafetySettings settings_of(const Setup& setup) {
  SafetySettings settings;
  settings.arming = setup.arming;
  settings.hold_after_s = 1e-9 * kHold;
  settings.vent_after_s = 1e-9 * kVent;
  settings.valve_silence_s = 1e-9 * kSilence;
  settings.deadman_timeout_s = 1e-9 * kDeadman;
  settings.law_vent_after_s = 1e-9 * kLawVent;
  settings.good_frames = kGoodFrames;
  settings.hold_overruns = setup.watches ? kHoldOverruns : 0;
  settings.vent_overruns = setup.watches ? kVentOverruns : 0;
  settings.valve_readback = setup.watches;
  return settings;
}

/// What an onlooker knows of the past, without a look into the monitor.
struct Onlooker {
  std::int64_t now_ns = kEpoch_ns;
  std::int64_t stopped_ns = kNever;  ///< end of the last stop, or of commands that expired
  std::int64_t excused_ns = kNever;  ///< what valves sent before may have been lost
  std::int64_t pending_ns = kNever;  ///< of an `arm` that has not led to ACTIVE
  int run = 0;                       ///< good frames in a row, that count
  bool may_move = false;             ///< nobody has taken the arming back since it was given
  bool ticked = false;
  bool shutting_down = false;
  bool vented = true;  ///< and nothing was commanded since
};

struct State {
  SafetyMonitor monitor;
  Onlooker seen;
};

}  // namespace

/// What can no longer matter, so that states which differ in nothing else are visited once: the end
/// of deafness when it has passed, and how long ago the last stop was when every measurement that
/// may come is newer.
struct ProofOfMonitor {
  static void forget(State& state) {
    Onlooker& seen = state.seen;
    SafetyMonitor& monitor = state.monitor;
    if (monitor.deaf_until_ns_ <= seen.now_ns) monitor.deaf_until_ns_ = kNever;
    if (seen.stopped_ns != kNever && seen.stopped_ns + kDeaf <= seen.now_ns)
      seen.stopped_ns = kNever;
    for (std::int64_t* since_ns : {&monitor.listening_since_ns_, &seen.excused_ns})
      if (*since_ns != kNever) *since_ns = std::max(*since_ns, seen.now_ns - 2 * kStep);
  }
};

namespace {

/// Its step with everything that must be true of it.
class Judge {
 public:
  explicit Judge(const Setup& setup)
      : setup_(setup),
        lapses_ns_(SafetyMonitor(settings_of(setup), kPeriod_s).thresholds().arm_lapses_ns) {}

  /// Ages beyond it are all alike.
  std::int64_t horizon_ns() const { return lapses_ns_ + kStep; }

  State start() const {
    alignas(State) static std::array<std::byte, sizeof(State)> zeros{};  // padding is compared too
    State& state = *new (zeros.data()) State{SafetyMonitor(settings_of(setup_), kPeriod_s), {}};
    state.seen.may_move = setup_.arming == Arming::automatic;
    return state;
  }

  /// Steps `state`. @throws std::logic_error for what must not be
  void step(State& state, const SafetyInput& in, std::span<const Reason> raised) const {
    Onlooker& seen = state.seen;
    const Mode before = state.monitor.mode();
    const Reason reason_before = state.monitor.reason();
    const std::int64_t gap_ns = seen.ticked ? in.now_ns - seen.now_ns : 0;
    if (seen.ticked) {
      if (gap_ns > kVent || in.paused || in.command_expired) seen.stopped_ns = in.now_ns;
      if (gap_ns > kSilence && in.newest_measurement_ns > seen.excused_ns)
        seen.excused_ns = in.now_ns;
    }
    const bool deaf = seen.stopped_ns != kNever && in.now_ns < seen.stopped_ns + kDeaf;
    const bool heard =
        !setup_.watches || seen.excused_ns == kNever || in.newest_measurement_ns > seen.excused_ns;

    present_.reset();
    for (const Reason reason : raised) add(reason, before, in.fully_vented);
    if (gap_ns > kVent) add(Reason::time_gap, before, in.fully_vented);
    const bool silent = in.newest_measurement_ns == kNever ||
                        in.now_ns - std::max(in.newest_measurement_ns, seen.excused_ns) > kSilence;
    if (setup_.watches && silent) add(Reason::valves_silent, before, in.fully_vented);
    const bool shutdown = in.requests.shutdown;
    const Mode demanded = worst();

    // Whether the arm may move at all. An `arm` is for what the operator sees, and lapses.
    const bool waiting = before <= Mode::wait_frames;
    const bool controlled = before == Mode::active || before == Mode::hold;
    const bool lapses = setup_.arming == Arming::explicit_ && !controlled;
    const bool hindered = demanded >= Mode::vent || (demanded == Mode::hold && lapses);
    if (in.requests.arm && !hindered && before != Mode::fault && !deaf) {
      if (!seen.may_move && lapses) seen.pending_ns = in.now_ns;
      seen.may_move = true;
    } else if (seen.pending_ns != kNever &&
               (hindered || in.now_ns - seen.pending_ns > lapses_ns_)) {
      seen.may_move = false;
    }
    if (setup_.arming == Arming::explicit_ && demanded >= Mode::vent) seen.may_move = false;
    if (in.requests.disarm || in.requests.lost || shutdown || demanded == Mode::fault)
      seen.may_move = false;
    if (!waiting && needs_operator()) seen.may_move = false;
    if (!seen.may_move) seen.pending_ns = kNever;

    const bool moving = before >= Mode::vent && !in.fully_vented;
    const bool counts = present_.none() && in.bad_frames == 0 && !moving && heard && !deaf;
    seen.run = counts ? std::min(seen.run + in.good_frames, kGoodFrames) : 0;
    seen.now_ns = in.now_ns;
    seen.ticked = true;
    seen.shutting_down = shutdown;

    const Mode after = state.monitor.step(in);
    const Reason reason = state.monitor.reason();
    seen.vented = in.fully_vented && after != Mode::active;
    require(after == state.monitor.mode(), "step returns the mode");

    // ACTIVE is for an arm that nothing speaks against, and HOLD for one that was ACTIVE.
    const bool at_rest = before == Mode::hold || in.fully_vented;
    const bool ready = seen.run == kGoodFrames && seen.may_move && at_rest;
    const bool active =
        present_.none() && (before == Mode::active || (before != Mode::fault && ready));
    require((after == Mode::active) == active, "ACTIVE if, and only if, nothing speaks against it");
    require(state.monitor.armed() == seen.may_move, "armed as long as nobody took it back");
    require(after != Mode::hold || before == Mode::active || before == Mode::hold,
            "HOLD follows ACTIVE only");
    if (after == Mode::active) seen.pending_ns = kNever;
    if (!active) require(after == expected(before, demanded, in), "the most severe cause wins");
    if (in.requests.emergency_stop)
      require(after == Mode::fault && reason == Reason::emergency_stop,
              "an emergency stop is FAULT");
    if (before == Mode::fault && after != Mode::fault)
      require(in.requests.disarm && !shutdown, "FAULT is left by disarming only");
    if (shutdown && after != Mode::fault)
      require(after == Mode::vent && reason == Reason::shutdown, "shutdown is final");
    check_reason(before, reason_before, after, reason, seen);
  }

 private:
  static void require(bool condition, const char* promise) {
    if (!condition) throw std::logic_error(promise);
  }
  bool watched(Reason reason) const {
    return setup_.watches || (reason != Reason::overruns && reason != Reason::many_overruns &&
                              reason != Reason::deadman_released && reason != Reason::law_silent &&
                              reason != Reason::law_late);
  }
  /// A reason's first row is for an arm with pressure where it has a second.
  void add(Reason reason, Mode mode, bool vented) const {
    if (!watched(reason)) return;
    const bool pressurised = mode == Mode::active || mode == Mode::hold || !vented;
    const auto rules = cause_table();
    std::size_t row = rules.size(), last = rules.size();
    for (std::size_t k = rules.size(); k-- > 0;) {
      if (rules[k].reason != reason) continue;
      if (last == rules.size()) last = k;
      row = k;
    }
    if (last == rules.size()) throw std::invalid_argument(name(reason));
    if (row == last || pressurised) present_.set(row);
    present_.set(last);
  }
  Mode worst() const {
    Mode mode = Mode::active;
    for (std::size_t k = 0; k < cause_table().size(); ++k)
      if (present_[k]) mode = std::max(mode, cause_table()[k].demands);
    return mode;
  }
  bool needs_operator() const {
    for (std::size_t k = 0; k < cause_table().size(); ++k) {
      const CauseRule& rule = cause_table()[k];
      if (present_[k] && rule.demands >= Mode::vent && rule.clearance != Clearance::good_frames)
        return true;
    }
    return false;
  }
  /// The mode where the arm is not to become ACTIVE.
  static Mode expected(Mode before, Mode demanded, const SafetyInput& in) {
    if (in.requests.emergency_stop) return Mode::fault;
    if (before != Mode::fault && in.requests.shutdown) return Mode::vent;
    if (before == Mode::fault)
      return in.requests.disarm && !in.requests.shutdown && demanded < Mode::fault ? Mode::vent
                                                                                   : Mode::fault;
    if (before <= Mode::wait_frames) return demanded == Mode::fault ? demanded : Mode::wait_frames;
    return std::max(before, demanded);
  }
  void check_reason(Mode before, Reason reason_before, Mode mode, Reason reason,
                    const Onlooker& seen) const {
    if (mode == Mode::active) return require(reason == Reason::none, "ACTIVE has no reason");
    if (mode == Mode::wait_frames) {
      // What keeps it waiting: a cause that would vent, or frames, or only the arm.
      Reason waits = seen.run < kGoodFrames ? Reason::waiting_for_frames : Reason::waiting_for_arm;
      for (std::size_t k = 0; k < cause_table().size() && waits == Reason::waiting_for_frames; ++k)
        if (present_[k] && cause_table()[k].demands == Mode::vent) waits = cause_table()[k].reason;
      if (waits == Reason::frames_stale) waits = Reason::waiting_for_frames;
      return require(reason == waits, "WAIT_FRAMES names what it waits for");
    }
    if (reason == Reason::waiting_for_arm)
      return require(
          !seen.may_move && seen.run == kGoodFrames && present_.none() && mode != Mode::fault,
          "an arm waits for arming only where nothing else holds it");
    // In VENT after it had waited for arming, and frames became bad again.
    const bool waited =
        reason_before == Reason::waiting_for_arm || reason_before == Reason::waiting_for_frames;
    if (reason == Reason::waiting_for_frames)
      return require(mode == Mode::wait_frames || (mode == Mode::vent && waited),
                     "waiting for frames is WAIT_FRAMES, or VENT after all else");
    // Of the causes that made the mode, the first in the table; that which made it stays.
    for (std::size_t k = 0; k < cause_table().size(); ++k) {
      const CauseRule& rule = cause_table()[k];
      const bool wins = rule.demands == mode || rule.clearance == Clearance::never;
      const bool keeps =
          mode == Mode::fault && before == Mode::fault && rule.reason != Reason::emergency_stop;
      if (!present_[k] || !wins || keeps) continue;
      return require(reason == rule.reason, "the reason is the most severe cause");
    }
    if (mode == Mode::vent && reason_before == Reason::waiting_for_arm && present_.any()) {
      std::size_t first = 0;
      while (!present_[first]) ++first;
      return require(reason == cause_table()[first].reason, "what holds it now is its reason");
    }
    require(mode == before && reason == reason_before, "without a new cause the reason stays");
  }

  Setup setup_;
  std::int64_t lapses_ns_;
  mutable std::bitset<64> present_;  ///< rows of the table
};

struct Input {
  SafetyInput in;
  std::array<int, 2> triggers;  ///< -1: none
};

struct Count {
  std::size_t states = 0, steps = 0;
};

std::string text(const std::vector<Input>& way, const Setup& setup) {
  std::string text;
  State state = Judge(setup).start();
  for (const Input& input : way) {
    text +=
        fmt::format("\n  +{} ms", 1e-6 * static_cast<double>(input.in.now_ns - state.seen.now_ns));
    for (const int trigger : input.triggers)
      if (trigger >= 0) text += fmt::format(" {}", name(kTriggers[std::size_t(trigger)].reason));
    text += fmt::format("{} good {} bad {}{}", input.in.requests.arm ? " arm" : "",
                        input.in.good_frames, input.in.bad_frames,
                        input.in.fully_vented ? " vented" : "");
    state.monitor.step(input.in);
    state.seen.now_ns = input.in.now_ns;
    text += fmt::format(" -> {} ({}){}", name(state.monitor.mode()), name(state.monitor.reason()),
                        state.monitor.armed() ? " armed" : "");
  }
  return text;
}

class Exploration {
 public:
  explicit Exploration(const Setup& setup)
      : setup_(setup), judge_(setup), frontier_(judge_.horizon_ns()) {
    const int count = static_cast<int>(kTriggers.size());
    sets_.push_back({-1, -1});
    for (int a = 0; a < count; ++a) sets_.push_back({a, -1});
    singles_ = sets_.size();
    for (int a = 0; a < count; ++a)
      for (int b = a + 1; b < count; ++b)
        if (kTriggers[std::size_t(a)].member != kTriggers[std::size_t(b)].member)
          sets_.push_back({a, b});
  }

  Count run() {
    const State first = judge_.start();
    frontier_.add(first, first.seen.now_ns, 0, {});
    for (std::size_t k = 0; k < frontier_.size(); ++k) {
      visit(k);
      get_back(k);
    }
    count_.states = frontier_.size();
    return count_;
  }

 private:
  void visit(std::size_t index) {
    const std::int64_t before_ns = frontier_[index].seen.now_ns;
    const std::int64_t excused_ns = frontier_[index].seen.excused_ns;
    for (const std::int64_t gap_ns : kGaps) {
      const std::int64_t now_ns = before_ns + gap_ns;
      SafetyInput in = healthy(now_ns);
      for (const std::int64_t measured_ns :
           {now_ns, now_ns - kSilence, now_ns - kSilence - kStep, excused_ns, kNever}) {
        in.newest_measurement_ns = measured_ns;
        for (int bits = 0; bits < 8; ++bits) {
          in.requests.arm = bits & 1;
          in.fully_vented = bits & 2;
          if (frontier_[index].seen.vented && !in.fully_vented) continue;
          in.bad_frames = bits & 4 ? 1 : 0;
          in.good_frames = 1;
          // Pairs where everything else would let the arm go on; the rest of the measurements alone.
          const bool usual = gap_ns == kGaps[0] && measured_ns == now_ns && !(bits & 4);
          const bool plain = measured_ns == now_ns || measured_ns == now_ns - kSilence - kStep;
          const std::size_t sets = usual ? sets_.size() : plain ? singles_ : 1;
          for (std::size_t k = 0; k < sets; ++k) step(index, in, sets_[k]);
        }
        if (!setup_.watches) break;
      }
    }
  }

  void step(std::size_t index, SafetyInput in, const std::array<int, 2>& triggers) {
    std::array<Reason, 3> raised;
    std::size_t count = 0;
    for (const int trigger : triggers) {
      if (trigger < 0) continue;
      kTriggers[std::size_t(trigger)].raise(in);
      raised[count++] = kTriggers[std::size_t(trigger)].reason;
    }
    in.deadman_used = in.law_used = setup_.watches;
    State next = frontier_[index];
    if (next.seen.shutting_down && !in.requests.shutdown) {  // it stays requested
      in.requests.shutdown = true;
      raised[count++] = Reason::shutdown;
    }
    ++count_.steps;
    try {
      judge_.step(next, in, std::span(raised).first(count));
    } catch (const std::logic_error& violated) {
      std::vector<Input> way = frontier_.way_to(index);
      way.push_back({in, triggers});
      throw std::runtime_error(violated.what() + text(way, setup_));
    }
    ProofOfMonitor::forget(next);
    frontier_.add(next, in.now_ns, index, {in, triggers});
  }

  /// Where nothing is wrong any more an operator can get back, whatever was before.
  void get_back(std::size_t index) {
    State state = frontier_[index];
    if (state.seen.shutting_down) return;
    const auto tick = [&](bool disarm, bool arm) {
      SafetyInput in = healthy(state.seen.now_ns + kGaps[0]);
      in.deadman_used = in.law_used = setup_.watches;
      in.fully_vented = true;
      in.good_frames = 1;
      in.requests.disarm = disarm;
      in.requests.arm = arm;
      const Reason raised[] = {Reason::disarmed};
      judge_.step(state, in, std::span(raised).first(disarm ? 1 : 0));
      ++count_.steps;
    };
    tick(true, false);
    for (std::int64_t waited_ns = 0; waited_ns < kDeaf; waited_ns += kGaps[0]) tick(false, false);
    for (int k = 0; k < kGoodFrames; ++k) tick(false, false);
    tick(false, true);
    if (state.monitor.mode() != Mode::active)
      throw std::runtime_error("no way back from" + text(frontier_.way_to(index), setup_));
  }

  Setup setup_;
  Judge judge_;
  proof::Frontier<State, Input> frontier_;
  std::vector<std::array<int, 2>> sets_;
  std::size_t singles_ = 0;
  Count count_;
};

TEST(MonitorProof, EveryCauseHasItsTrigger) {
  for (const CauseRule& rule : cause_table()) {
    bool found = rule.reason == Reason::valves_silent;
    for (const Trigger& trigger : kTriggers) found |= trigger.reason == rule.reason;
    EXPECT_TRUE(found) << name(rule.reason);
  }
}

TEST(MonitorProof, AnArmLapsesAfterTwoSecondsAndTwiceTheGoodFrames) {
  SafetySettings settings;
  settings.good_frames = 50;
  settings.frame_period_s = 0.125;
  EXPECT_EQ(resolve_thresholds(settings, 0.002).arm_lapses_ns, 14'500 * kMs);
  settings.frame_period_s = 0.002;
  EXPECT_EQ(resolve_thresholds(settings, 0.125).arm_lapses_ns, 14'500 * kMs);
}

/// In steps that are shorter than those of the exploration.
TEST(MonitorProof, NeitherFramesNorArmCountForHalfASecondAfterAStop) {
  for (const int cause : {0, 1, 2}) {
    SafetyMonitor monitor(settings_of({Arming::explicit_, false}), kPeriod_s);
    SafetyInput in = healthy(kEpoch_ns);
    in.fully_vented = true;
    monitor.step(in);
    in = healthy(kEpoch_ns + (cause == 0 ? kVent + 1 : 1));
    in.paused = cause == 1;
    in.command_expired = cause == 2;
    monitor.step(in);
    const std::int64_t stopped_ns = in.now_ns;
    for (std::int64_t later_ns = 100 * kMs; later_ns <= kDeaf + 100 * kMs; later_ns += 100 * kMs) {
      in = healthy(stopped_ns + later_ns);
      in.fully_vented = in.requests.arm = true;
      in.good_frames = 1;
      monitor.step(in);
      EXPECT_EQ(monitor.armed(), later_ns >= kDeaf) << cause << " after " << later_ns;
      EXPECT_EQ(monitor.mode() == Mode::active, later_ns >= kDeaf + 100 * kMs) << cause;
    }
  }
}

TEST(MonitorProof, EveryReachableStateKeepsEveryPromise) {
  Count sum;
  for (const Arming arming : {Arming::explicit_, Arming::automatic}) {
    for (const bool watches : {true, false}) {
      Count count;
      ASSERT_NO_THROW(count = Exploration({arming, watches}).run());
      sum.states += count.states;
      sum.steps += count.steps;
    }
  }
  fmt::print("safety monitor: {} states, {} steps\n", sum.states, sum.steps);
}

}  // namespace
}  // namespace softarm
