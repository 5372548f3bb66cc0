// softarm run: the daemon's pipeline and the simulated arm in one process, in lock step.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <optional>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/python.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/commands.hpp"
#include "apps/softarm/law_process.hpp"
#include "apps/softarm/learned_output.hpp"
#include "apps/softarm/plots.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/config/load.hpp"
#include "softarm/recording/experiment_log.hpp"
#include "softarm/recording/logged_run.hpp"
#include "softarm/recording/shape_log.hpp"
#include "softarm/recording/tracking_summary.hpp"
#include "softarm/simulation/lock_step.hpp"

namespace softarm {
namespace {

struct RunOptions {
  std::string config;
  std::string out = "out";
  std::string mocap_log, learned, law;
  bool plots = true;
  double duration_s = 0.0;
  std::uint64_t seed = 0;
  bool has_seed = false;
};

struct Recorded {
  std::int64_t took_ns = 0;  ///< wall time, with the log
  bool active = false, was_active = false;
  Reason left = Reason::none;  ///< why ACTIVE was left the last time
};

/// Steps the source of the rows to its end, or to `duration_s`; one row per tick, or per
/// `ticks_a_row` ticks.
template <class Stepper>
void record(Stepper& stepper, double duration_s, double period_s, std::int64_t ticks_a_row,
            ExperimentLog& log, ShapeLog& shapes, TrackingSummary& summary, Recorded& recorded) {
  Progress progress;
  LogRow row;
  const auto ticks = static_cast<std::int64_t>(std::llround(duration_s / period_s));
  for (std::int64_t k = 0; k < ticks; ++k) {
    const bool logged = k % ticks_a_row == 0;
    if (stop_requested != 0 || !stepper.step(row, logged)) break;
    const TickOutput& output = stepper.pipeline().output();
    if (recorded.active && output.mode != Mode::active) recorded.left = output.reason;
    recorded.active = output.mode == Mode::active;
    recorded.was_active |= recorded.active;
    if (!logged) continue;
    log.add(row);
    shapes.add(row);
    summary.add(row, static_cast<double>(ticks_a_row) * period_s);
    if (progress.due())
      progress.update(fmt::format("{:.1f} of {:.1f} s, {}", row.t_s, duration_s, name(row.mode)));
  }
}

/// Why an arm was never ACTIVE, from its state at the end.
std::string never_active(const TickOutput& end, int good_frames, double duration_s) {
  std::string text = fmt::format("the arm was never ACTIVE in {:.3g} s: {} ({})", duration_s,
                                 name(end.mode), name(end.reason));
  if (end.reason == Reason::waiting_for_frames)
    text += fmt::format("; it takes {} good frames in a row (safety.good_frames)", good_frames);
  return text;
}

int run(const RunOptions& options) {
  Experiment experiment = load_experiment(options.config);
  if (options.has_seed) experiment.seed = experiment.plant.seed = options.seed;
  if (!options.law.empty()) experiment.control.law = ExternalLaw{};
  if (options.law.empty() && experiment.control.law.get_if<ExternalLaw>() != nullptr)
    return fail("softarm", kExitUsage,
                "control.law is external: in simulation name it, --law MODULE:CLASS");
  const double duration_s =
      options.duration_s > 0.0 ? options.duration_s : experiment.run.duration_s;
  const double period_s = 1.0 / experiment.rate_hz;
  LearnedOutput learned(options.learned, experiment, options.config);

  catch_stop_signals();  // what was recorded until then is kept

  TrackingSummary summary(experiment.arm.size(), experiment.run.tracking_from_s);
  summary.set_arm(experiment.arm);
  if (experiment.actuation.kind == ActuationKind::torque) summary.commands_are_torques();
  TimingReport timing;
  std::string failure, warning;
  const Files inputs = options.mocap_log.empty() ? Files() : Files{options.mocap_log};
  const auto record_and_report = [&](auto& stepper) {
    ExperimentLog log(options.out, experiment, inputs);
    ShapeLog shapes(options.out, experiment, inputs);
    SummaryFiles files(options.out, experiment, inputs);
    const double log_rate_hz = experiment.run.log_rate_hz;
    const std::int64_t ticks_a_row =
        log_rate_hz > 0.0 ? std::max(1LL, std::llround(experiment.rate_hz / log_rate_hz)) : 1;
    Recorded recorded;
    const std::int64_t before_ns = monotonic_now_ns();
    try {
      record(stepper, duration_s, period_s, ticks_a_row, log, shapes, summary, recorded);
      log.close();
      shapes.close();
    } catch (const OutputError& error) {  // what was recorded until then has a summary too
      failure = error.what();
    }
    recorded.took_ns = monotonic_now_ns() - before_ns;
    const ControlPipeline& pipeline = stepper.pipeline();
    summary.set_frames(pipeline.counters(), pipeline.late_frames());
    timing.real_time_factor =
        summary.duration_s() / to_seconds(std::max<std::int64_t>(1, recorded.took_ns));
    if (!recorded.was_active && failure.empty() && stop_requested == 0)
      failure =
          never_active(pipeline.output(), experiment.safety.good_frames, summary.duration_s());
    if (recorded.was_active && !recorded.active)
      warning = fmt::format("softarm: warning: at the end the arm is {}; it left ACTIVE for {}\n",
                            name(pipeline.output().mode), name(recorded.left));
    timing.histograms = {{"tick_us", stepper.tick_times().counts(), stepper.tick_times().max_us()}};
    files.write(summary.json(), timing_json(timing));
  };
  std::unique_ptr<LoggedRun> logged;
  if (options.mocap_log.empty()) {
    const auto steps = std::make_unique<LockStep>(experiment, experiment.plant);
    std::optional<LawProcess> law;
    if (!options.law.empty()) {
      law.emplace(options.law, options.config, experiment);
      steps->set_law(
          [&law](const auto& output, auto& answer) { return law->answer(output, answer); });
    }
    record_and_report(*steps);
  } else {
    logged = std::make_unique<LoggedRun>(experiment, options.mocap_log);
    record_and_report(*logged);
  }
  release_stop_signals();
  fmt::print("{}{:.0f} times faster than real time; log, summary and timing are in {}\n",
             summary.table(), timing.real_time_factor, options.out);
  if (const std::string unwritten = learned.write(summary.observer(), "the simulated arm");
      failure.empty())
    failure = unwritten;
  if (stop_requested != 0 && failure.empty())
    failure = fmt::format("stopped after {:.3g} of {:.3g} s", summary.duration_s(), duration_s);
  else if (options.plots)
    draw_plots(options.out);
  say(warning);
  if (!failure.empty()) print_error("softarm", failure);
  if (logged) {
    const LogTimeline& timeline = logged->timeline();
    if (!timeline.text().empty())
      say(fmt::format("softarm: {}: {}: {}\n", timeline.restarted() ? "error" : "warning",
                      options.mocap_log, timeline.text()));
    if (logged->log().damage_count() > 0)
      print_error("softarm", options.mocap_log + ": " + logged->log().damage_text());
    if (logged->log().damage_count() > 0 || timeline.restarted()) return kExitData;
  }
  return failure.empty() ? kExitOk : kExitFailure;
}

}  // namespace

void add_run_command(CLI::App& app) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command =
      app.add_subcommand("run", "Run an experiment on the simulated arm, faster than real time");
  command->add_option("CONFIG", options->config, "experiment in YAML")->required();
  command
      ->add_option("--out", options->out, "folder for log.csv, summary.json, timing.json and plots")
      ->capture_default_str();
  command
      ->add_option("--duration", options->duration_s,
                   "simulated time in s (default: run.duration_s)")
      ->check(positive_seconds());
  CLI::Option* log =
      command->add_option("--mocap", options->mocap_log,
                          "take the frames from this LCM log instead of the simulated arm");
  command
      ->add_option("--law", options->law,
                   "control by this Python class, MODULE:CLASS or FILE.py:CLASS (softarm.law)")
      ->check(law_name())
      ->excludes(log);
  add_learned_option(*command, options->learned);
  command->add_flag("!--no-plots", options->plots, "do not draw the plots");
  auto* seed = command
                   ->add_option("--seed", options->seed,
                                "seed of noise and dropouts (default: the configuration's)")
                   ->check(seed_number());
  run_where_given(*command, [options, seed] {
    options->has_seed = seed->count() > 0;
    return run(*options);
  });
}

}  // namespace softarm
