#include "softarm/commissioning/preflight/pulses.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/commissioning/preflight/checks.hpp"
#include "softarm/runtime/safety_monitor.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kLost_ns = 200'000'000;  ///< without a frame, or when the daemon would vent
constexpr double kSoft_bar_per_s = 1.0;
constexpr double kBefore_s = 0.2;  ///< at rest, to compare with

class Player {
 public:
  Player(const Experiment& experiment, LcmNode& node, ArmListener& listener, Commander& commander,
         const std::function<bool()>& stop)
      : node_(node),
        listener_(listener),
        commander_(commander),
        stop_(stop),
        lost_ns_(std::max(
            kLost_ns,
            resolve_thresholds(experiment.safety, 1.0 / experiment.rate_hz).vent_after_ns)),
        least_bar_(PressureVector::Constant(commander.chambers(),
                                            experiment.actuation.min_pressure_bar)) {}

  void pulse(Pulse pulse, double hold_s) {
    pulse.before_ns = monotonic_now_ns();
    hold(least_bar_, kBefore_s);
    PressureVector filled_bar = least_bar_;
    filled_bar[pulse.valve] = pulse.pressure_bar;
    pulse.start_ns = monotonic_now_ns();
    reach(filled_bar);
    hold(filled_bar, 2.0 / 3.0 * hold_s);
    pulse.held_ns = monotonic_now_ns();
    hold(filled_bar, hold_s / 3.0);
    pulse.end_ns = monotonic_now_ns();
    if (!aborted_.empty()) return;
    listener_.seen().pulses.push_back(pulse);
    reach(least_bar_);
    rest(hold_s);
  }
  void rest(double time_s) { hold(least_bar_, 0.75 * time_s); }

  const std::string& aborted() const { return aborted_; }

 private:
  template <class Done>
  void command(const PressureVector& bar, const Done& done) {
    for (std::int64_t now_ns = monotonic_now_ns(); !done(now_ns); now_ns = monotonic_now_ns()) {
      if (aborted_.empty())
        aborted_ = stop_ && stop_()       ? "stopped"
                   : commander_.held_up() ? Commander::kHeldUp
                                          : listener_.beyond_limits(lost_ns_);
      if (!aborted_.empty()) return;
      commander_.update(bar, kSoft_bar_per_s, now_ns);
      node_.wait_until(commander_.next_ns());
      listener_.look_at_clock();
    }
  }
  void hold(const PressureVector& bar, double time_s) {
    const std::int64_t end_ns = monotonic_now_ns() + to_ns(time_s);
    command(bar, [&](std::int64_t now_ns) { return now_ns >= end_ns; });
  }
  void reach(const PressureVector& bar) {
    command(bar, [&](std::int64_t) { return commander_.sent_bar() == bar; });
  }

  LcmNode& node_;
  ArmListener& listener_;
  Commander& commander_;
  const std::function<bool()>& stop_;
  std::int64_t lost_ns_;
  PressureVector least_bar_;
  std::string aborted_;
};

}  // namespace

std::string play_pulses(const Experiment& experiment, const PulsePlan& plan, LcmNode& node,
                        ArmListener& listener, Commander& commander,
                        const std::function<bool()>& stop,
                        const std::function<void(const std::string&)>& progress) {
  listener.commanding();
  Player player(experiment, node, listener, commander, stop);
  const double least_bar = experiment.actuation.min_pressure_bar;
  try {
    player.rest(1.0);  // whoever holds the valves gets to know us with zeros
    int valve = 0;
    for (int i = 0; i < experiment.arm.size(); ++i) {
      const auto& chambers = experiment.actuation.segments[static_cast<std::size_t>(i)];
      for (int j = 0; j < static_cast<int>(chambers.size()) && player.aborted().empty();
           ++j, ++valve) {
        if (progress) progress(fmt::format("pulse {} of {}", valve + 1, commander.chambers()));
        const double above_bar =
            plan.pressure_bar > 0.0 ? plan.pressure_bar : soft_pressure_bar(experiment, i, j);
        player.pulse({.segment = i,
                      .chamber = j,
                      .valve = valve,
                      .pressure_bar =
                          std::min(least_bar + above_bar, experiment.actuation.max_pressure_bar)},
                     plan.hold_s);
      }
    }
  } catch (...) {
    commander.vent_to_rest();
    throw;
  }
  const std::string aborted = player.aborted();
  commander.vent_to_rest();
  return aborted;
}

}  // namespace softarm
