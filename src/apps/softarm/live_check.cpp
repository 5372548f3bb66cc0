#include "apps/softarm/live_check.hpp"

#include <fmt/format.h>

#include <memory>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/commissioning/preflight/checks.hpp"

namespace softarm {
namespace {

void listen(LcmNode& node, ArmListener& listener, double time_s, Progress& progress) {
  const std::int64_t start_ns = monotonic_now_ns();
  const auto end_ns = start_ns + to_ns(time_s);
  for (std::int64_t now_ns = start_ns; now_ns < end_ns && stop_requested == 0;
       now_ns = monotonic_now_ns()) {
    node.wait_until(std::min(end_ns, now_ns + 10'000'000));
    listener.look_at_clock();
    progress.update(fmt::format("listening: {:.0f} of {:.0f} s, {} frames",
                                to_seconds(now_ns - start_ns), time_s,
                                listener.seen().frames.size()));
  }
  listener.seen().rest_end_ns = monotonic_now_ns();
}

int print(const std::vector<Finding>& findings, bool json) {
  fmt::print("{}", json ? report_json(findings) : report_text(findings));
  return any_failed(findings) ? kExitFailure : kExitOk;
}

int pulse(const Experiment& experiment, const LiveCheckOptions& options, LcmNode& node,
          ArmListener& listener, Commander& commander, Progress& progress) {
  const std::vector<Finding> at_rest = preflight(experiment, listener.seen());
  if (const std::string other = listener.other_commander(); !other.empty()) {
    print(at_rest, options.json);
    print_error("softarm", "no chamber was filled: " + other);
    return kExitOtherInstance;
  }
  if (const std::string obstacle = obstacle_to_pulses(at_rest); !obstacle.empty()) {
    print(at_rest, options.json);
    print_error("softarm",
                "no chamber was filled: without these nobody would watch its limits: " + obstacle);
    return kExitFailure;
  }
  say("softarm check: filling every chamber softly, one after the other: THE ARM MOVES. Ctrl-C "
      "vents.\n");
  const std::string aborted = play_pulses(
      experiment, options.plan, node, listener, commander, [] { return stop_requested != 0; },
      [&](const std::string& text) { progress.update(text); });
  const int code = print(preflight(experiment, listener.seen()), options.json);
  if (aborted.empty()) return code;
  print_error("softarm", fmt::format("vented after {} of {} chambers: {}",
                                     listener.seen().pulses.size(), commander.chambers(), aborted));
  return kExitFailure;
}

}  // namespace

int check_live(const Experiment& experiment, const LiveCheckOptions& options) {
  if (options.pulse && experiment.actuation.kind == ActuationKind::torque) {
    print_error("softarm", "--pulse fills chambers; expected actuation by chambers, got torque");
    return kExitUsage;
  }
  const double highest_bar = experiment.actuation.max_pressure_bar;
  if (options.plan.pressure_bar + experiment.actuation.min_pressure_bar > highest_bar) {
    print_error(
        "softarm",
        fmt::format("--pressure: expected at most actuation.max_pressure_bar of {} bar, got "
                    "{} bar",
                    highest_bar, options.plan.pressure_bar));
    return kExitUsage;
  }
  catch_stop_signals();
  ignore_broken_pipes();
  LcmNode node(experiment.transport.lcm.url);
  // First of all: nobody may begin to command while we listen.
  std::unique_ptr<Commander> commander;
  if (options.pulse) commander = std::make_unique<Commander>(experiment, node);
  ArmListener listener(experiment, node, true);
  Progress progress(!options.json);
  listen(node, listener, options.listen_s, progress);
  if (stop_requested != 0) {
    print_error("softarm", "interrupted while listening: nothing was commanded or judged");
    return kExitFailure;
  }
  if (commander) return pulse(experiment, options, node, listener, *commander, progress);
  return print(preflight(experiment, listener.seen()), options.json);
}

}  // namespace softarm
