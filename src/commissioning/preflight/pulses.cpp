#include "softarm/commissioning/preflight/pulses.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "commissioning/guarded_motion.hpp"
#include "softarm/commissioning/preflight/checks.hpp"
#include "softarm/runtime/safety_monitor.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kLost_ns = 200'000'000;  ///< without a frame, or when the daemon would vent
constexpr double kSoft_bar_per_s = 1.0;
constexpr double kBefore_s = 0.2;  ///< at rest, to compare with

std::int64_t lost_ns(const Experiment& experiment) {
  return std::max(kLost_ns,
                  resolve_thresholds(experiment.safety, 1.0 / experiment.rate_hz).vent_after_ns);
}

class Player {
 public:
  Player(ArmClient& client, Observer& observer, const std::function<bool()>& stop)
      : client_(client),
        observer_(observer),
        motion_(client, lost_ns(client.experiment()), stop),
        least_bar_(PressureVector::Constant(client.set_points_bar().size(),
                                            client.experiment().actuation.min_pressure_bar)) {}

  void pulse(Pulse pulse, double hold_s) {
    pulse.before_ns = client_.now_ns();
    hold(least_bar_, kBefore_s);
    PressureVector filled_bar = least_bar_;
    filled_bar[pulse.valve] = pulse.pressure_bar;
    pulse.start_ns = client_.now_ns();
    reach(filled_bar);
    hold(filled_bar, 2.0 / 3.0 * hold_s);
    pulse.held_ns = client_.now_ns();
    hold(filled_bar, hold_s / 3.0);
    pulse.end_ns = client_.now_ns();
    if (!aborted().empty()) return;
    observer_.add(pulse);
    reach(least_bar_);
    rest(hold_s);
  }
  void rest(double time_s) { hold(least_bar_, 0.75 * time_s); }

  const std::string& aborted() const { return motion_.aborted(); }

 private:
  void hold(const PressureVector& bar, double time_s) {
    const std::int64_t end_ns = client_.now_ns() + to_ns(time_s);
    motion_.command(bar, kSoft_bar_per_s, [&] { return client_.now_ns() >= end_ns; });
  }
  void reach(const PressureVector& bar) {
    motion_.command(bar, kSoft_bar_per_s, [&] { return client_.set_points_bar() == bar; });
  }

  ArmClient& client_;
  Observer& observer_;
  GuardedMotion motion_;
  PressureVector least_bar_;
};

}  // namespace

std::string play_pulses(ArmClient& client, Observer& observer, const PulsePlan& plan,
                        const std::function<bool()>& stop,
                        const std::function<void(const std::string&)>& progress) {
  const Experiment& experiment = client.experiment();
  const ActuationSettings& actuation = experiment.actuation;
  Player player(client, observer, stop);
  player.rest(1.0);  // with zeros, so that the valve driver accepts us as the sender
  int valve = 0;
  for (int i = 0; i < experiment.arm.size(); ++i) {
    const auto chambers = static_cast<int>(actuation.segments[static_cast<std::size_t>(i)].size());
    for (int j = 0; j < chambers && player.aborted().empty(); ++j, ++valve) {
      if (progress) progress(fmt::format("pulse {} of {}", valve + 1, chamber_count(actuation)));
      const double above_bar =
          plan.pressure_bar > 0.0 ? plan.pressure_bar : soft_pressure_bar(experiment, i, j);
      player.pulse({.segment = i,
                    .chamber = j,
                    .valve = valve,
                    .pressure_bar = std::min(actuation.min_pressure_bar + above_bar,
                                             actuation.max_pressure_bar)},
                   plan.hold_s);
    }
  }
  client.vent_to_rest();
  return player.aborted();
}

}  // namespace softarm
