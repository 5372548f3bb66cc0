#include "softarm/apps/valve_driver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "apps/program.hpp"
#include "apps/signals.hpp"
#include "softarm/base/instance_lock.hpp"
#include "softarm/base/line_log.hpp"
#include "softarm/base/realtime.hpp"
#include "softarm/base/service_notifier.hpp"
#include "softarm/base/time.hpp"
#include "softarm/base/version.hpp"
#include "softarm/config/load.hpp"
#include "softarm/transport/valves_loop.hpp"
#include "softarm/valves/valve_backend.hpp"
#include "softarm/valves/valve_driver.hpp"

namespace softarm {
namespace {

ValveGuardSettings guard_settings(const Experiment& experiment) {
  return {.driver = experiment.valves,
          .chambers = static_cast<int>(experiment.valves.order.size()),
          .max_pressure_bar = experiment.actuation.max_pressure_bar,
          .slew_bar_per_s = experiment.actuation.slew_bar_per_s,
          .rise_bar_per_s = experiment.actuation.vent_bar_per_s,
          .longest_validity_s = experiment.safety.command_validity_s,
          .wait_for_zero = experiment.safety.arming == Arming::explicit_};
}

void print_summary(const std::string& program, const ValvesLoop& loop,
                   const ValveCounters& counters) {
  say(fmt::format(
      "{}: {} cycles, {} missed; {} connections, {} lost, {} late answers, {} exception replies, "
      "{} times degraded; {} commands refused\n",
      program, counters.cycles, loop.late_cycles(), counters.connections, counters.broken,
      counters.no_answers, counters.exceptions, counters.times_degraded, loop.refused()));
}

/// Prints every change and reports to the service manager; returns true if zero was confirmed at
/// the end.
bool drive(const std::string& program, const Experiment& experiment, ValveDriver& driver) {
  ServiceNotifier service;
  if (!service.problem().empty()) say(fmt::format("{}: warning: {}\n", program, service.problem()));
  LineLog log(program, say);  // before the scheduling changes, which its thread would inherit
  RealtimeSettings realtime = experiment.realtime;
  realtime.cpu = -1;  // the tick's own
  realtime.priority = std::max(1, realtime.priority - 1);
  for (const std::string& refused : apply_realtime_settings(realtime))
    say(fmt::format("{}: warning: {}\n", program, refused));
  ValvesLoop loop(experiment.transport.lcm, experiment.valves.rate_hz, driver);
  std::array<char, 200> text;
  std::int64_t shortened_ns = 0;  // reported validity of commands that are not held so long
  const bool vented = loop.run(
      [] { return stop_requested != 0; },
      [&](const ValvesLoop::Report& report) {
        if (report.changed)
          log.add("{:.3f} s: {}", to_seconds(report.since_start_ns), driver.text(text));
        const CommandExpiry& commands = driver.guard().commands();
        if (commands.asked_ns() > commands.longest_ns() && commands.asked_ns() != shortened_ns) {
          shortened_ns = commands.asked_ns();
          log.add(
              "commands ask to be held for {:.3g} s; they expire after "
              "daemon.lcm.command_validity_s, {:.3g} s",
              to_seconds(shortened_ns), to_seconds(commands.longest_ns()));
        }
        service.report(report.now_ns, {.state = name(driver.guard().state()),
                                       .reason = name(driver.guard().reason()),
                                       .on_time = report.on_time,
                                       .stopping = driver.stopping()});
      });
  log.finish();
  print_summary(program, loop, driver.guard().counters());
  return vented;
}

int serve(const std::string& program, const std::string& path) {
  const Experiment experiment = load_experiment(path);
  if (experiment.actuation.kind == ActuationKind::torque)
    throw ConfigError(path, 0, "actuation.kind", "chambers: a terminal has valves, not moments",
                      "torque");
  const LcmSettings& lcm = experiment.transport.lcm;
  const ValveDriverSettings& valves = experiment.valves;
  std::unique_ptr<ValveBackend> backend;
  try {
    backend = make_valve_backend(valves, experiment.actuation.max_pressure_bar);
  } catch (const std::invalid_argument& error) {
    return fail(program, kExitConfiguration, fmt::format("{}: {}", path, error.what()));
  }
  const InstanceLock commands_lock(lock_name("valves of " + lcm.command_channel, lcm.url));
  const InstanceLock measurement_lock(lock_name(lcm.measurement_channel, lcm.url));
  const InstanceLock hardware_lock("terminal " + backend->address());
  catch_stop_signals();
  ignore_broken_pipes();
  say(fmt::format("{} {} commit {} configuration {}: {}, {} valves by {} at {}, {} Hz\n", program,
                  version_text(), commit_text(), hash_text(experiment.hash), experiment.name,
                  valves.order.size(), valves.backend, backend->address(), valves.rate_hz));
  if (const std::string warning = backend->warning(); !warning.empty())
    say(fmt::format("{}: warning: {}\n", program, warning));
  if (const std::string warning = network_warning(lcm.url); !warning.empty())
    say(fmt::format("{}: warning: {}\n", program, warning));
  ValveDriver driver(guard_settings(experiment), std::move(backend));
  if (drive(program, experiment, driver)) return kExitOk;
  return fail(program, kExitFailure,
              fmt::format("measured pressures did not fall to {} bar; the valves vent by their own "
                          "time-out of {} s",
                          valves.vented_bar, valves.failsafe_timeout_s));
}

}  // namespace

int run_valve_driver(int argc, char** argv) {
  const std::string program = std::filesystem::path(argv[0]).filename().string();
  CLI::App app("Pressure commands from LCM to valves, measured pressures back", program);
  std::string config;
  app.add_option("CONFIG", config, "experiment in YAML")->required();
  return run_program(argc, argv, app, [&] { return serve(program, config); });
}

}  // namespace softarm
