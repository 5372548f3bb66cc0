// softarmd: the control daemon. Motion-capture frames in, valve pressures out, at a fixed rate.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <iostream>
#include <thread>

#include "apps/program.hpp"
#include "apps/signals.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/instance_lock.hpp"
#include "softarm/base/realtime.hpp"
#include "softarm/base/service_notifier.hpp"
#include "softarm/base/version.hpp"
#include "softarm/config/load.hpp"
#include "softarm/transport/daemon_link.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

/// Hands mode changes, and what was refused, from the tick's thread to one that may wait for a
/// terminal or a journal. Bounded: what does not fit is counted, not queued.
class ModeLog {
 public:
  ModeLog() : thread_([this](const std::stop_token& stop) { print_until(stop); }) {}

  /// Prints what is still to be printed and ends the thread.
  void finish() { thread_ = {}; }

  void add(std::int64_t since_start_ns, Mode mode, Reason reason) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == kCapacity) {
      lost_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    entries_[head % kCapacity] = {since_start_ns, mode, reason};
    head_.store(head + 1, std::memory_order_release);
  }

  /// How many messages were refused so far.
  void malformed(std::int64_t total) noexcept {
    malformed_.store(total, std::memory_order_relaxed);
  }

 private:
  static constexpr std::size_t kCapacity = 64;
  static constexpr std::int64_t kTellEvery_ns = 1'000'000'000;
  struct Entry {
    std::int64_t since_start_ns;
    Mode mode;
    Reason reason;
  };

  /// What is malformed comes at any rate; it is told once a second at most.
  void print_malformed(bool last) {
    const std::int64_t total = malformed_.load(std::memory_order_relaxed);
    const std::int64_t now_ns = monotonic_now_ns();
    if (total == malformed_told_ || (!last && now_ns - malformed_told_ns_ < kTellEvery_ns)) return;
    say(fmt::format("softarmd: {} malformed messages refused, {} in all\n", total - malformed_told_,
                    total));
    malformed_told_ = total;
    malformed_told_ns_ = now_ns;
  }

  void print_until(const std::stop_token& stop) {
    while (true) {
      const bool last = stop.stop_requested();
      for (std::size_t tail = tail_.load(); tail != head_.load(std::memory_order_acquire);
           tail_.store(++tail)) {
        const Entry& entry = entries_[tail % kCapacity];
        say(fmt::format("softarmd: {:.3f} s: {} ({})\n",
                        1e-9 * static_cast<double>(entry.since_start_ns), name(entry.mode),
                        name(entry.reason)));
      }
      if (const auto lost = lost_.exchange(0); lost > 0)
        say(fmt::format("softarmd: {} mode changes came too fast to be printed\n", lost));
      print_malformed(last);
      if (last) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

  std::array<Entry, kCapacity> entries_{};
  std::atomic<std::size_t> head_{0}, tail_{0};
  std::atomic<std::int64_t> lost_{0}, malformed_{0};
  std::int64_t malformed_told_ = 0, malformed_told_ns_ = 0;
  std::jthread thread_;
};

/// Keeps the deadline, and the account of how well it was kept.
class DaemonLoop {
 public:
  DaemonLoop(const Experiment& experiment, bool shadow, ModeLog& log, ServiceNotifier& service)
      : pipeline_(experiment),
        link_(experiment, experiment.transport,
              {.version = fmt::format("{} {}", version_text(), commit_text()),
               .configuration_hash = experiment.hash,
               .seed = experiment.seed,
               .build = build_text()},
              shadow),
        ticks_per_second_(static_cast<std::int64_t>(experiment.rate_hz)),
        log_{.log = log},
        service_(service) {}

  /// Returns once a stop was requested and every pressure has been commanded to zero.
  void run() {
    // Without SCHED_FIFO, or where it was refused, overruns say nothing about the daemon.
    judge_overruns_ = runs_under_fifo();
    const std::int64_t start_ns = monotonic_now_ns();
    PeriodicDeadline deadline(pipeline_.period_ns(), start_ns);
    int vented_commands = 0;
    while (vented_commands < kLastCommands) {
      sleep_until_ns(deadline.next_ns());
      const std::int64_t woken_ns = monotonic_now_ns();
      if (woken_ns < deadline.next_ns()) continue;  // a signal cut the sleep short
      timing_.lateness.add_ns(woken_ns - deadline.next_ns());
      tick(woken_ns);
      log_.changed(woken_ns - start_ns, pipeline_.output());
      const std::int64_t missed = deadline.advance(monotonic_now_ns());
      timing_.overruns += missed;
      missed_in_row_ =
          missed > 0 ? missed_in_row_ + static_cast<int>(std::min(missed, kManyMissed)) : 0;
      log_.log.malformed(link_.malformed());
      service_.report(woken_ns, {.state = name(pipeline_.output().mode),
                                 .reason = name(pipeline_.output().reason),
                                 .on_time = missed == 0,
                                 .stopping = stop_requested != 0});
      if (stop_requested != 0 && pipeline_.output().reason == Reason::shutdown &&
          pipeline_.fully_vented())
        ++vented_commands;
    }
    // What was sent only once, not all at once: a logger's queue is short.
    while (link_.repeat_record()) sleep_until_ns(monotonic_now_ns() + kRepeatPause_ns);
  }

  const LoopTiming& timing() const { return timing_; }
  const ControlPipeline& pipeline() const { return pipeline_; }
  const DaemonLink& link() const { return link_; }

 private:
  /// Zero commands sent before leaving: one may be lost on the wire.
  static constexpr int kLastCommands = 3;
  static constexpr std::int64_t kRepeatPause_ns = 500'000;
  static constexpr std::int64_t kManyMissed = 1'000'000;  ///< more are no worse, and fit an int

  void tick(std::int64_t woken_ns) noexcept {
    TickInput input = link_.collect(woken_ns);
    input.requests.shutdown = stop_requested != 0;
    input.consecutive_overruns = judge_overruns_ ? missed_in_row_ : 0;
    const TickOutput& output = pipeline_.tick(input);
    const std::int64_t decided_ns = monotonic_now_ns();
    link_.publish_command(decided_ns, output);
    ++timing_.ticks;
    link_.publish_status(woken_ns, pipeline_, timing_);
    link_.publish_record(input, output);
    if (timing_.ticks % ticks_per_second_ == 0) link_.publish_timing(woken_ns, timing_);
    timing_.tick.add_ns(decided_ns - woken_ns);
    timing_.publish.add_ns(monotonic_now_ns() - decided_ns);
    if (output.frame_age_s >= 0.0)
      timing_.frame_age.add_ns(static_cast<std::int64_t>(1e9 * output.frame_age_s));
  }

  struct ModeWatch {
    void changed(std::int64_t since_start_ns, const TickOutput& output) noexcept {
      if (output.mode == mode && output.reason == reason) return;
      mode = output.mode;
      reason = output.reason;
      log.add(since_start_ns, mode, reason);
    }
    ModeLog& log;
    Mode mode = Mode::init;
    Reason reason = Reason::none;
  };

  ControlPipeline pipeline_;
  DaemonLink link_;
  bool judge_overruns_ = false;
  std::int64_t ticks_per_second_;
  int missed_in_row_ = 0;
  LoopTiming timing_;
  ModeWatch log_;
  ServiceNotifier& service_;
};

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
  const FrameCounters& frames = loop.pipeline().counters();
  say(fmt::format(
      "softarmd: {} ticks, {} missed; frames: {} accepted, {} rejected, {} repeated, {} missing; "
      "{} malformed messages, {} not sent\n",
      timing.ticks, timing.overruns, frames.accepted,
      frames.rejected() + loop.pipeline().late_frames(), frames.repeated, frames.missing,
      loop.link().malformed(), loop.link().unsent()));
}

int serve(const std::string& path, bool shadow) {
  const Experiment experiment = load_experiment(path);
  const LcmSettings& lcm = experiment.transport.lcm;
  const std::string channel = lcm.command_channel + (shadow ? " (shadow)" : "");
  const InstanceLock lock(lock_name(channel, lcm.url));
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
  // A thread inherits the scheduling in force when it starts. The one that prints gets none of it;
  // LCM's receive thread stays one below the tick, which a flood of messages would else starve.
  ModeLog log;
  // The tick's own priority is asked for first, and its refusal told: whatever is refused later is
  // the same, or less was asked for.
  const RealtimeSettings& realtime = experiment.realtime;
  for (const std::string& refused : apply_realtime_settings(realtime))
    say(fmt::format("softarmd: warning: {}\n", refused));
  RealtimeSettings below_tick = realtime;
  below_tick.priority = std::max(1, below_tick.priority - 1);
  apply_realtime_settings(below_tick);
  DaemonLoop loop(experiment, shadow, log, service);
  apply_realtime_settings(realtime);
  loop.run();
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
