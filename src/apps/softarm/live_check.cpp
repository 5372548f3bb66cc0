#include "apps/softarm/live_check.hpp"

#include <fmt/format.h>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "softarm/base/time.hpp"
#include "softarm/commissioning/preflight/checks.hpp"

namespace softarm {
namespace {

void listen(ArmClient& client, Observer& observer, double time_s, Progress& progress) {
  const std::int64_t start_ns = client.now_ns();
  const auto interrupted = [&] {
    progress.update(fmt::format("listening: {:.0f} of {:.0f} s, {} frames",
                                to_seconds(client.now_ns() - start_ns), time_s,
                                observer.seen().frames.size()));
    return stop_requested != 0;
  };
  client.wait_for(interrupted, time_s);
  observer.rest_ends();
}

int print(const std::vector<Finding>& findings, bool json) {
  fmt::print("{}", json ? report_json(findings) : report_text(findings));
  if (any_failed(findings)) return kExitFailure;
  return any_not_checked(findings) ? kExitNotChecked : kExitOk;
}

int pulse(const LiveCheckOptions& options, ArmClient& client, Observer& observer,
          Progress& progress) {
  const Experiment& experiment = client.experiment();
  std::string other = client.other_commander();
  if (other.empty() && observer.seen().commanded_by_others)
    other = "another program commanded pressures on " + experiment.transport.lcm.command_channel;
  const std::vector<Finding> at_rest = preflight(experiment, observer.seen());
  if (!other.empty()) {
    print(at_rest, options.json);
    return fail("softarm", kExitOtherInstance, "no chamber was filled: " + other);
  }
  if (const std::string obstacle = obstacle_to_pulses(at_rest); !obstacle.empty()) {
    print(at_rest, options.json);
    return fail(
        "softarm", kExitFailure,
        "no chamber was filled: its limits could not be watched without these: " + obstacle);
  }
  say("softarm check: filling every chamber softly, one after the other: THE ARM MOVES. Ctrl-C "
      "vents.\n");
  const std::string aborted = play_pulses(
      client, observer, options.plan, [] { return stop_requested != 0; },
      [&](const std::string& text) { progress.update(text); });
  const int code = print(preflight(experiment, observer.seen()), options.json);
  if (aborted.empty()) return code;
  return fail("softarm", kExitFailure,
              fmt::format("vented after {} of {} chambers: {}", observer.seen().pulses.size(),
                          chamber_count(experiment.actuation), aborted));
}

}  // namespace

int check_live(const Experiment& experiment, const LiveCheckOptions& options) {
  if (options.pulse && experiment.actuation.kind == ActuationKind::torque)
    return fail("softarm", kExitUsage,
                "--pulse fills chambers; expected actuation by chambers, got torque");
  const double highest_bar = experiment.actuation.max_pressure_bar;
  if (options.plan.pressure_bar + experiment.actuation.min_pressure_bar > highest_bar)
    return fail(
        "softarm", kExitUsage,
        fmt::format("--pressure: expected at most actuation.max_pressure_bar of {} bar, got "
                    "{} bar",
                    highest_bar, options.plan.pressure_bar));
  catch_stop_signals();
  ignore_broken_pipes();
  ArmClient client(experiment);
  // First of all, so that no other program begins to command while this one listens.
  if (options.pulse) client.lock_commands();
  Observer observer(client);
  Progress progress(!options.json);
  listen(client, observer, options.listen_s, progress);
  if (stop_requested != 0)
    return fail("softarm", kExitFailure,
                "interrupted while listening: nothing was commanded or judged");
  if (options.pulse) return pulse(options, client, observer, progress);
  return print(preflight(experiment, observer.seen()), options.json);
}

}  // namespace softarm
