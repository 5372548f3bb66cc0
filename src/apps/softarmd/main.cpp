// softarmd: the control daemon. Motion-capture frames in, valve pressures out, at a fixed rate.
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "apps/program.hpp"
#include "apps/signals.hpp"
#include "softarm/base/fault_latch.hpp"
#include "softarm/base/instance_lock.hpp"
#include "softarm/base/line_log.hpp"
#include "softarm/base/realtime.hpp"
#include "softarm/base/service_notifier.hpp"
#include "softarm/base/time.hpp"
#include "softarm/base/version.hpp"
#include "softarm/config/load.hpp"
#include "softarm/transport/daemon_loop.hpp"
#include "softarm/transport/input_report.hpp"
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
  void note(Mode mode, Reason reason) noexcept {
    if (mode == Mode::fault) {
      latch_.set(name(reason));
    } else if (mode_ == Mode::fault) {
      latch_.clear();
    }
    mode_ = mode;
  }

 private:
  FaultLatch latch_;
  Mode mode_ = Mode::init;
};

/// Prints every change of mode or reason, and what was refused; reports to the service manager.
void run(DaemonLoop& loop, LineLog& log, ServiceNotifier& service, const LcmSettings& lcm,
         Latched* latched) {
  constexpr std::int64_t kRefused_ns = 1'000'000'000;  // malformed messages may come at any rate
  Mode mode = Mode::init;
  Reason reason = Reason::none;
  std::int64_t refused = 0, left_out = 0, refused_reported_ns = kNever;
  const auto report_refused = [&](std::int64_t now_ns) {
    const std::int64_t total = loop.link().malformed();
    const std::int64_t total_left_out = loop.pipeline().frames_left_out();
    if (now_ns < refused_reported_ns + kRefused_ns) return;
    if (total != refused)
      log.add("{} malformed messages refused, {} in all", total - refused, total);
    if (total_left_out != left_out)
      log.add("{} frames too many in one tick for the observer, {} in all",
              total_left_out - left_out, total_left_out);
    if (total != refused || total_left_out != left_out) refused_reported_ns = now_ns;
    refused = total;
    left_out = total_left_out;
  };
  InputReport report_inputs;
  const auto report_streams = [&](std::int64_t now_ns) {
    const InputReport::Counts counts{
        .mode = mode,
        .frames = loop.pipeline().counters(),
        .late_frames = loop.pipeline().late_frames(),
        .frame_channel = lcm.mocap_channel,
        .measurements = {lcm.measurement_channel, loop.link().backward_measurements()},
        .references = {lcm.reference_channel, loop.link().backward_references()},
        .live = loop.link().live_counts(loop.pipeline()),
        .answers = loop.link().law_counts(loop.pipeline())};
    for (const auto report : {&InputReport::refusals, &InputReport::refused_references,
                              &InputReport::refused_answers, &InputReport::second_sender})
      if (const auto text = (report_inputs.*report)(now_ns, counts); !text.empty())
        log.add("{}", text);
  };
  std::optional<MocapStanding> standing;
  const auto report_mocap = [&] {
    if (std::exchange(standing, loop.link().mocap_standing()) != standing)
      log.add("motion capture: {} {}", standing->text(), standing->body);
  };
  std::int32_t held_us = loop.link().asked_us();
  const auto report_validity = [&] {
    if (loop.link().held_us() == held_us) return;
    held_us = loop.link().held_us();
    if (held_us < loop.link().asked_us())
      log.add(
          "commands are valid for {:.3g} s (daemon.lcm.command_validity_s), but the valve side "
          "lets "
          "them expire after {:.3g} s",
          1e-6 * loop.link().asked_us(), 1e-6 * held_us);
  };
  loop.run([] { return stop_requested != 0; },
           [&](const DaemonLoop::Report& report) {
             const TickOutput& output = loop.pipeline().output();
             if (output.mode != mode || output.reason != reason) {
               mode = output.mode;
               reason = output.reason;
               if (latched != nullptr) latched->note(mode, reason);
               const bool verdict = reason == Reason::frames_refused;
               log.add("{:.3f} s: {} ({}{}{})", to_seconds(report.since_start_ns), name(mode),
                       name(reason), verdict ? ": " : "", verdict ? name(output.refusal) : "");
             }
             report_refused(report.woken_ns);
             report_streams(report.woken_ns);
             report_mocap();
             report_validity();
             service.report(report.woken_ns, {.state = name(mode),
                                              .reason = name(reason),
                                              .on_time = report.on_time,
                                              .stopping = report.stopping});
           });
  report_refused(kForever);
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
  if (latched && latched->begins_stopped()) loop.begin_stopped();
  run(loop, log, service, lcm, latched ? &*latched : nullptr);
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
