// softarmd: the control daemon. Motion-capture frames in, valve pressures out, at a fixed rate.
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "apps/program.hpp"
#include "apps/signals.hpp"
#include "apps/softarmd/loop_reports.hpp"
#include "softarm/base/fault_latch.hpp"
#include "softarm/base/instance_lock.hpp"
#include "softarm/base/line_log.hpp"
#include "softarm/base/realtime.hpp"
#include "softarm/base/service_notifier.hpp"
#include "softarm/base/time.hpp"
#include "softarm/base/version.hpp"
#include "softarm/config/load.hpp"
#include "softarm/transport/daemon_loop.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

void print_summary(const DaemonLoop& loop) {
  const LoopTiming& timing = loop.timing();
  const auto line = [](const char* what, const DurationHistogram& histogram) {
    say(fmt::format("softarmd: {:<10} p50 {:>8.1f} us   p99 {:>8.1f} us   max {:>8.1f} us\n", what,
                    quantile_us(histogram.counts(), 0.5), quantile_us(histogram.counts(), 0.99),
                    histogram.max_us()));
  };
  line("lateness", timing.lateness);
  line("frame age", timing.frame_age);
  line("tick", timing.tick);
  line("publish", timing.publish);
  if (timing.law.max_us() > 0.0) line("law", timing.law);
  const FrameCounters& frames = loop.pipeline().counters();
  say(fmt::format(
      "softarmd: {} ticks, {} missed; frames: {} accepted, {} rejected, {} repeated, {} missing; "
      "{} malformed messages, {} not sent\n",
      timing.ticks, timing.overruns, frames.accepted,
      frames.rejected() + loop.pipeline().late_frames(), frames.repeated, frames.missing,
      loop.link().malformed(), loop.link().unsent()));
}

/// Keeps every FAULT until an operator has acknowledged it, beyond the end of this process too.
class Latched {
 public:
  Latched(const std::string& name, const std::string& path, LineLog& log)
      : latch_(state_directory(), name) {
    if (!latch_.problem().empty())
      log.add("warning: {}: {}; a FAULT will be forgotten when softarmd ends",
              latch_.file().string(), latch_.problem());
    if (!begins_stopped()) return;
    log.add("FAULT: {} of the last run, which nobody has acknowledged ({})", latch_.found(),
            latch_.file().string());
    log.add("FAULT: once the arm may move again, softarm disarm {}, then softarm arm {}", path,
            path);
  }
  bool begins_stopped() const { return !latch_.found().empty(); }
  /// In every tick. Whether a FAULT is kept already.
  bool keep(Mode mode, Reason reason) noexcept {
    if (mode != mode_ || reason != reason_) {
      if (mode == Mode::fault) {
        latch_.set(name(reason));
      } else if (mode_ == Mode::fault) {
        latch_.clear();
      }
    }
    mode_ = mode;
    reason_ = reason;
    return latch_.kept();
  }

 private:
  FaultLatch latch_;
  Mode mode_ = Mode::init;
  Reason reason_ = Reason::none;
};

/// Prints every change of mode or reason, and what was refused; reports to the service manager.
void run(DaemonLoop& loop, LineLog& log, ServiceNotifier& service, const LcmSettings& lcm) {
  Mode mode = Mode::init;
  Reason reason = Reason::none;
  LoopReports reports(loop, lcm, log);
  loop.run([] { return stop_requested != 0; },
           [&](const DaemonLoop::Report& report) {
             const TickOutput& output = loop.pipeline().output();
             if (output.mode != mode || output.reason != reason) {
               mode = output.mode;
               reason = output.reason;
               const bool verdict = reason == Reason::frames_refused;
               log.add("{:.3f} s: {} ({}{}{})", to_seconds(report.since_start_ns), name(mode),
                       name(reason), verdict ? ": " : "", verdict ? name(output.refusal) : "");
             }
             reports.report(report.woken_ns, mode);
             service.report(report.woken_ns, {.state = name(mode),
                                              .reason = name(reason),
                                              .on_time = report.on_time,
                                              .stopping = report.stopping});
           });
  reports.report_refused(kForever);
}

int serve(const std::string& path, bool shadow) {
  const Experiment experiment = load_experiment(path);
  const LcmSettings& lcm = experiment.transport.lcm;
  const std::string channel = lcm.command_channel + (shadow ? " (shadow)" : "");
  const std::string name = lock_name(channel, lcm.url);
  const InstanceLock lock(name);
  catch_stop_signals();
  ignore_broken_pipes();

  say(fmt::format("softarmd {} commit {} configuration {:016x} seed {}: {} at {} Hz{}\n",
                  version_text(), commit_text(), experiment.hash, experiment.seed, experiment.name,
                  experiment.rate_hz,
                  shadow ? ", shadow: commands are marked as not for the valves" : ""));
  for (const std::string& warning : experiment_warnings(experiment))
    say(fmt::format("softarmd: warning: {}\n", warning));
  ServiceNotifier service;
  if (!service.problem().empty()) say(fmt::format("softarmd: warning: {}\n", service.problem()));
  // A thread inherits the scheduling in force when it starts. The threads that print and that write
  // the latch get none of it;
  // LCM's receive thread stays one below the tick, which a flood of messages would otherwise
  // starve.
  LineLog log("softarmd", say);
  std::optional<Latched> latched;  // a shadow commands nothing
  if (!shadow) latched.emplace(name, path, log);
  // The tick's priority is requested first and its refusal is reported: a later refusal has the
  // same cause, or is for a lower priority.
  const RealtimeSettings& realtime = experiment.realtime;
  for (const std::string& refused : apply_realtime_settings(realtime))
    say(fmt::format("softarmd: warning: {}\n", refused));
  RealtimeSettings below_tick = realtime;
  below_tick.priority = std::max(1, below_tick.priority - 1);
  apply_realtime_settings(below_tick);
  DaemonLoop loop(experiment, experiment.transport,
                  {.version = fmt::format("{} {}", version_text(), commit_text()),
                   .configuration_hash = experiment.hash,
                   .seed = experiment.seed,
                   .build = build_text()},
                  shadow);
  apply_realtime_settings(realtime);
  if (latched)
    loop.keep_faults([&](Mode mode, Reason reason) { return latched->keep(mode, reason); });
  if (latched && latched->begins_stopped()) loop.begin_stopped();
  run(loop, log, service, lcm);
  log.finish();
  print_summary(loop);
  return kExitOk;
}

}  // namespace
}  // namespace softarm

int main(int argc, char** argv) {
  CLI::App app(
      "Control daemon for soft continuum arms: motion-capture frames in, valve pressures out",
      "softarmd");
  std::string config;
  bool shadow = false;
  app.add_option("CONFIG", config, "experiment in YAML")->required();
  app.add_flag("--shadow", shadow, "run everything, but mark commands as not for the valves");
  return softarm::run_program(argc, argv, app, [&] { return softarm::serve(config, shadow); });
}
