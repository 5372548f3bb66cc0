// Daemon, wire, valve side and terminal together: the classes that decide, in one process, with a
// network that loses, delays, repeats and plays messages again, a second commander, people who
// press keys at any time, and parts that stop or die. Random, from fixed seeds.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <deque>
#include <random>
#include <vector>

#include "milliseconds.hpp"
#include "softarm/actuation/command_expiry.hpp"
#include "softarm/actuation/pressure_ramps.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/valves/valve_guard.hpp"

namespace softarm {
namespace {

using test::kMs;
constexpr std::int64_t kTick = 10 * kMs, kValidity = 100 * kMs, kFailsafe = 200 * kMs;
constexpr double kTick_s = 0.01, kFull_bar = 2.0, kVent_bar_per_s = 8.0;
/// The daemon's own ramp to zero, with a stop in it that is shorter than the validity.
constexpr std::int64_t kRamp = 250 * kMs + kValidity;
/// A command may come as late as its validity, which then counts from its arrival.
constexpr std::int64_t kInForce = 2 * kValidity + kTick;
/// The ramp of the daemon, its last command, the terminal's time-out once to notice
/// and one and a half times to be silent, and some cycles.
constexpr std::int64_t kBound = kRamp + kInForce + kFailsafe * 5 / 2 + 10 * kTick;

struct Command {
  std::int64_t due_ns = 0, sequence = 0, sent_us = 0;
  double bar = 0.0;
};

class Station {
 public:
  Station(Arming arming, unsigned seed)
      : random_(seed),
        arming_(arming),
        monitor_(safety(arming), kTick_s),
        ramps_(actuation()),
        guard_(valves()) {}

  void run(int ticks) {
    for (int k = 0; k < ticks && !::testing::Test::HasFatalFailure(); ++k) {
      now_ns_ += kTick;
      spells();
      people();
      if (daemon_runs_) daemon();
      if (foreign_) send({now_ns_, 1'000'000 + k, now_ns_ / 1000, kFull_bar});
      if (driver_runs_) valve_side();
      judge();
    }
  }
  int activations() const { return activations_; }
  std::int64_t pressurised_ticks() const { return pressurised_ticks_; }

 private:
  static SafetySettings safety(Arming arming) {
    SafetySettings it;
    it.arming = arming;
    it.good_frames = 3;
    it.valve_readback = true;
    it.valve_silence_s = 0.1;
    it.command_validity_s = 1e-9 * kValidity;
    return it;
  }
  static ActuationSettings actuation() {
    ActuationSettings it;
    it.max_pressure_bar = kFull_bar;
    it.vent_bar_per_s = kVent_bar_per_s;
    return it;
  }
  static ValveGuardSettings valves() {
    ValveGuardSettings it;
    it.driver.rate_hz = 100.0;
    it.driver.failsafe_timeout_s = 1e-9 * kFailsafe;
    it.driver.backoff_s = 0.1;
    it.driver.longest_backoff_s = 0.5;
    it.max_pressure_bar = kFull_bar;
    it.longest_validity_s = 1e-9 * kValidity;
    return it;
  }

  bool chance(double p) { return std::bernoulli_distribution(p)(random_); }
  void spell(bool& healthy, double begins, double ends) {
    healthy = healthy ? !chance(begins) : chance(ends);
  }

  void spells() {
    spell(frames_, 0.002, 0.05);
    const bool ran = daemon_runs_;
    spell(daemon_runs_, 0.001, 0.03);
    if (!ran && daemon_runs_ && chance(0.5)) {  // not resumed but started again
      monitor_ = SafetyMonitor(safety(arming_), kTick_s);
      bar_.setZero();
      sent_us_ = kNever;
      sequence_ = 0;
      new_daemon_ = true;
      may_press_ = monitor_.armed();
    }
    spell(driver_runs_, 0.001, 0.03);
    spell(wire_, 0.001, 0.05);
    spell(link_, 0.001, 0.03);
    spell(obeys_, 0.001, 0.03);
    bool calm = !foreign_;
    spell(calm, 0.0005, 0.1);
    foreign_ = !calm;
  }

  void people() {
    const bool stop = chance(0.0005);
    const bool disarm = chance(0.002) || (monitor_.mode() == Mode::fault && chance(0.02));
    requests_.arm |= chance(0.02);
    requests_.disarm |= disarm;
    requests_.emergency_stop |= stop;
    // The valve side hears them too, while no daemon runs as well.
    if (!wire_ || !driver_runs_) return;
    if (disarm) guard_.acknowledge();
    if (stop) guard_.emergency_stop();
    if (disarm) emergency_ns_ = kNever;
    if (stop) emergency_ns_ = now_ns_;
  }

  void send(const Command& command) {
    if (!wire_ || chance(0.02)) return;
    flight_.push_back(command);
    if (chance(0.02))
      flight_.back().due_ns += std::uniform_int_distribution<int>(1, 30)(random_) * kTick;
    if (chance(0.02)) flight_.push_back(command);
    if (chance(0.01)) recorded_ = command;
    if (recorded_.sequence > 0 && chance(0.01)) {
      recorded_.due_ns = now_ns_;
      flight_.push_back(recorded_);
    }
  }

  /// What the tick of the daemon and its link do about safety.
  void daemon() {
    const std::int64_t now_us = now_ns_ / 1000;
    SafetyInput in;
    in.now_ns = now_ns_;
    const bool expired = sent_us_ == kNever || has_expired(sent_us_, kValidity / 1000, now_us);
    in.command_expired = (expired || vented_count_ != seen_vented_count_) && !new_daemon_;
    seen_vented_count_ = vented_count_;
    if (expired || in.command_expired) bar_.setZero();
    if (frames_) newest_frame_ns_ = now_ns_;
    in.newest_capture_ns = newest_frame_ns_;
    in.good_frames = frames_ ? 1 : 0;
    in.newest_measurement_ns = newest_measurement_ns_;
    in.fully_vented = bar_.isZero(0.0);
    in.newest_foreign_ns = foreign_ && wire_ ? now_ns_ : kNever;
    in.requests = requests_;
    requests_ = {};
    new_daemon_ = false;
    const Mode before = monitor_.mode();
    const bool armed = monitor_.armed();
    const Mode mode = monitor_.step(in);
    if (mode == Mode::active && before != Mode::active) ++activations_;
    // With explicit arming a cause that vents takes back what an `arm` has given.
    if (mode >= Mode::vent && before < Mode::vent && arming_ == Arming::explicit_)
      may_press_ = false;
    if (monitor_.armed() && !armed) {
      ASSERT_TRUE(in.requests.arm);
      may_press_ = true;
    }
    if (!monitor_.armed()) may_press_ = false;
    const double before_bar = bar_[0];
    if (mode == Mode::active)
      ramps_.limit(bar_, PressureVector::Constant(1, chance(0.5) ? kFull_bar : 0.5), kTick_s, bar_);
    if (mode != Mode::active && mode != Mode::hold) ramps_.vent(bar_, kTick_s, bar_);
    if (mode == Mode::active || mode == Mode::hold) controlled_ns_ = now_ns_;
    ASSERT_TRUE(may_press_ || bar_[0] <= before_bar)
        << "pressure without an arm since the last VENT";
    said_.push_back({now_ns_, 0, 0, bar_[0]});
    if (said_.size() > kInForce / kTick) said_.pop_front();
    sent_us_ = now_us;
    send({now_ns_, ++sequence_, now_us, bar_[0]});
  }

  /// What the valve driver and its link do, with a terminal behind them.
  void valve_side() {
    if (secured_ && now_ns_ - fed_ns_ >= kFailsafe) held_bar_ = 0.0;
    const bool listen = guard_.wake(now_ns_);
    std::size_t kept = 0;
    for (const Command& command : flight_) {
      if (command.due_ns > now_ns_) {
        flight_[kept++] = command;
      } else if (listen && !is_untimely(command.sent_us, kValidity / 1000, now_ns_ / 1000)) {
        guard_.command({.sequence = command.sequence,
                        .validity_ns = kValidity,
                        .sent_us = command.sent_us,
                        .pressure_bar = {&command.bar, 1}},
                       now_ns_);
      }
    }
    flight_.resize(kept);
    const double before_bar = held_bar_;
    const LinkResult result = link_ ? LinkResult::ok : LinkResult::no_answer;
    switch (guard_.next(now_ns_)) {
      case ValveAction::wait:
        break;
      case ValveAction::connect:
        guard_.connected(link_, now_ns_);
        break;
      case ValveAction::secure:
        if (link_) secured_ = true;
        if (link_) fed_ns_ = now_ns_;
        guard_.secured(result, link_, now_ns_);
        break;
      case ValveAction::exchange: {
        if (guard_.may_read()) {
          ReadBack back(1);
          back.actual_bar[0] = back.echo_bar[0] = held_bar_;
          back.has_echo = true;
          guard_.measured(result, back, now_ns_);
          if (link_ && wire_) {
            newest_measurement_ns_ = now_ns_;
            vented_count_ = guard_.counters().times_vented;
          }
        }
        if (guard_.failsafe_due(now_ns_)) guard_.failsafe_checked(result, true, now_ns_);
        if (guard_.state() == ValveState::disconnected || !guard_.may_write()) break;
        if (link_) fed_ns_ = now_ns_;
        if (link_ && obeys_) held_bar_ = guard_.set_points_bar()[0];
        guard_.written(result, now_ns_);
        break;
      }
    }
    // A second commander alone with the valves is their commander; else nothing raises pressures but
    // a command of the daemon that is still valid.
    if (foreign_ || now_ns_ - foreign_ns_ < kInForce) return;
    if (held_bar_ > before_bar) {
      double most_bar = 0.0;
      for (const Command& command : said_)
        if (now_ns_ - command.due_ns <= kInForce) most_bar = std::max(most_bar, command.bar);
      ASSERT_LE(held_bar_, most_bar) << "more than any command that may be in force";
    }
  }

  void judge() {
    if (foreign_) foreign_ns_ = now_ns_;
    if (!driver_runs_ && secured_ && now_ns_ - fed_ns_ >= kFailsafe) held_bar_ = 0.0;
    pressurised_ticks_ += held_bar_ > 0.0;
    if (held_bar_ == 0.0) return;
    ASSERT_TRUE(emergency_ns_ == kNever || now_ns_ - emergency_ns_ <= kBound)
        << "an emergency stop that the valve side heard";
    const std::int64_t since_ns = now_ns_ - std::max(controlled_ns_, foreign_ns_);
    ASSERT_LE(since_ns, kBound) << fmt::format("{} bar, {}, {}", held_bar_, name(monitor_.mode()),
                                               name(guard_.state()));
    // A part that stands still does not keep the pressure either.
    const bool whole = daemon_runs_ && driver_runs_ && wire_ && link_;
    if (whole || foreign_) whole_ns_ = now_ns_;
    ASSERT_LE(now_ns_ - whole_ns_, kBound) << "one part has stopped for longer";
  }

  std::mt19937 random_;
  Arming arming_;
  std::int64_t now_ns_ = 1'000'000 * kMs;

  SafetyMonitor monitor_;
  PressureRamps ramps_;
  PressureVector bar_ = PressureVector::Zero(1);
  OperatorRequests requests_;
  std::int64_t sent_us_ = kNever, sequence_ = 0, newest_frame_ns_ = kNever,
               newest_measurement_ns_ = kNever, vented_count_ = 0, seen_vented_count_ = 0;
  bool new_daemon_ = true;

  std::vector<Command> flight_;
  std::deque<Command> said_;  ///< by the daemon, in the last kInForce
  Command recorded_;

  ValveGuard guard_;
  double held_bar_ = 0.0;
  bool secured_ = false;
  std::int64_t fed_ns_ = 0;

  bool frames_ = true, daemon_runs_ = true, driver_runs_ = true, wire_ = true, link_ = true,
       obeys_ = true, foreign_ = false;

  bool may_press_ = arming_ == Arming::automatic;
  std::int64_t controlled_ns_ = 0, foreign_ns_ = 0, whole_ns_ = 0;
  std::int64_t emergency_ns_ = kNever;  ///< until a disarm
  int activations_ = 0;
  std::int64_t pressurised_ticks_ = 0;
};

TEST(CompositionProof, NoPressureWithoutAnArmAndEveryStopVentsWithinItsBound) {
  constexpr int kSeeds = 20, kTicks = 50'000;
  std::int64_t activations = 0, pressurised = 0;
  for (const Arming arming : {Arming::explicit_, Arming::automatic}) {
    for (unsigned seed = 1; seed <= kSeeds; ++seed) {
      SCOPED_TRACE(fmt::format("seed {}", seed));
      Station station(arming, seed);
      ASSERT_NO_FATAL_FAILURE(station.run(kTicks));
      activations += station.activations();
      pressurised += station.pressurised_ticks();
    }
  }
  EXPECT_GT(activations, 1000);
  EXPECT_GT(pressurised, 100'000);
  fmt::print(
      "daemon, wire, valve side and terminal: {} ticks, {} activations, {} ticks with pressure\n",
      2 * kSeeds * kTicks, activations, pressurised);
}

}  // namespace
}  // namespace softarm
