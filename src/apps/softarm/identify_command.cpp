// softarm identify: stiffness, damping and gains of the PCC model, as in the paper's section
// VII-B1: from steps played on the simulated arm, in lock step or over LCM, or from a recorded log.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <thread>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/commands.hpp"
#include "softarm/base/version.hpp"
#include "softarm/commissioning/identification/coverage.hpp"
#include "softarm/commissioning/identification/fit_report.hpp"
#include "softarm/commissioning/identification/identify.hpp"
#include "softarm/commissioning/identification/live_experiment.hpp"
#include "softarm/commissioning/identification/log_record.hpp"
#include "softarm/commissioning/identification/model_comparison.hpp"
#include "softarm/commissioning/identification/residual_parts.hpp"
#include "softarm/config/load.hpp"
#include "softarm/recording/experiment_log.hpp"

namespace softarm {
namespace {

struct Command {
  std::string config, output, log, out;
  std::string damage;  ///< of the log
  LoggedInput input = LoggedInput::commanded;
  FitChoice choice;
  StepPlan plan;
  CoverageStudy study;
  IdentifyOptions options;
  double from_s = 0.0, to_s = 0.0, skip_s = 0.0, apart_s = 0.0;
  std::uint64_t seed = 0;
  bool has_seed = false, has_hold = false, no_lag = false, no_delay = false;
  bool no_stiffness = false, no_damping = false, no_inertia = false;
  bool linear = false, predict = false, compare = false, coverage = false, live = false;
};

int threads() { return static_cast<int>(std::max(1U, std::thread::hardware_concurrency())); }

MotionRecord play(const Experiment& experiment, const Command& command) {
  catch_stop_signals();
  ignore_broken_pipes();
  Progress progress(true);
  const LiveOutcome outcome = play_steps(
      experiment, command.plan, [] { return stop_requested != 0; },
      [&](const std::string& text) { progress.update(text); });
  release_stop_signals();  // nothing moves any more
  if (!outcome.aborted.empty())
    throw std::runtime_error("vented, nothing identified: " + outcome.aborted);
  return outcome.record;
}

MotionRecord record_of(const Experiment& experiment, Command& command) {
  if (command.live) return play(experiment, command);
  if (command.log.empty()) return record_step_response(experiment, command.plan);
  const LoggedMotion logged = read_log(experiment, command.log, command.input);
  command.damage = logged.damage;
  MotionRecord record = logged.record;
  const double end_s = record.time_s[record.time_s.size() - 1] + 1e-6;
  const double to_s = command.to_s > 0.0 ? std::min(command.to_s, end_s) : end_s;
  record = record.part(command.from_s, to_s, 0.0);
  record.scored_from_s = command.from_s + command.skip_s;
  if (command.apart_s > 0.0) record = record.thinned(command.apart_s);
  return record;
}

int print_coverage(const Experiment& experiment, const Command& command) {
  catch_stop_signals();
  Progress progress(true);
  CoverageStudy study = command.study;
  study.threads = threads();
  const CoverageTable table = study_coverage(
      experiment, command.plan, command.choice, study,
      [&](int done) { progress.update(fmt::format("{} of {} seeds", done, study.seeds)); },
      [] { return stop_requested != 0; });
  fmt::print(
      "{} seeds; errors relative to the truth, which is drawn within {:.0f} % of the "
      "configured\n{}",
      table.seeds, 100.0 * study.spread, coverage_text(table));
  return kExitOk;
}

void write_findings(const Experiment& experiment, const Command& command, const ParameterSet& set,
                    const Refinement& fit) {
  if (!command.out.empty()) {
    const std::filesystem::path folder(command.out);
    std::filesystem::create_directories(folder);
    write_text(folder / "identification.csv", residuals_csv(fit));
    fmt::print("{} has what was measured and simulated: tools/plot_identification.py {}\n",
               (folder / "identification.csv").string(), command.out);
  }
  if (command.output.empty()) return;
  const std::string note = fmt::format(
      "Identified by softarm {} from {}: residual {:.3g} mrad rms of a motion of {:.3g} mrad rms.",
      version_text(),
      command.live          ? "steps on the running arm"
      : command.log.empty() ? "steps on the simulated arm"
                            : command.log,
      1e3 * fit.rms_rad, 1e3 * fit.motion_rms_rad);
  write_text(command.output, identified_yaml(experiment, set.arm(fit.x), command.choice, note,
                                             command.config, command.output));
  load_experiment(command.output);
  fmt::print("{} has them: softarm run {}\n", command.output, command.output);
}

int identify(Command& command) {
  Experiment experiment = load_experiment(command.config);
  if (command.has_seed) experiment.seed = experiment.plant.seed = command.seed;
  if (!command.has_hold) command.plan.hold_s = experiment.identification.hold_s;
  command.choice.lag = !command.no_lag;
  command.choice.delay = !command.no_delay;
  command.choice.stiffness = !command.no_stiffness;
  command.choice.damping = !command.no_damping;
  command.choice.inertia = !command.no_inertia;
  if (command.coverage) return print_coverage(experiment, command);
  // Told before the arm moves, not after.
  const auto folder = (std::filesystem::path(".") / command.output).parent_path();
  if (!std::filesystem::is_directory(folder)) {
    print_error("softarm", fmt::format("--output: there is no folder {}", folder.string()));
    return kExitUsage;
  }

  const MotionRecord record = record_of(experiment, command);
  const ParameterSet set(believed(experiment), experiment.actuation.kind, command.choice);
  if (command.linear) {
    const LinearFit fit = fit_linear_and_lag(set, record, set.believed(), command.options.window_s,
                                             command.options.longest_lag_s);
    fmt::print("{}", linear_table(set, fit));
    return kExitOk;
  }
  Progress progress;
  command.options.refinement.threads = threads();
  command.options.refinement.progress = [&](const std::string& text) { progress.update(text); };
  if (command.compare) {
    const ModelComparison comparison =
        compare_models(experiment, record, command.choice, command.options,
                       [&](const std::string& text) { progress.update(text); });
    const Refinement& fit = comparison.trials.back().result.whole;
    fmt::print("{}\nas asked, on the whole record:\n{}{}", comparison_text(comparison),
               fit_table(set, fit), residual_parts_text(residual_parts(record, fit)));
    write_findings(experiment, command, set, fit);
    return kExitOk;
  }
  if (command.predict) {
    const Refinement fit = predict(set, record, set.of(believed(experiment)));
    fmt::print(
        "{} predicts u to {:.4g} mrad rms a component; the motion's own is {:.4g} mrad rms "
        "about its mean\n",
        command.config, 1e3 * fit.rms_rad, 1e3 * fit.motion_rms_rad);
    write_findings(experiment, command, set, fit);
    return kExitOk;
  }
  const Refinement fit = softarm::identify(set, record, command.options);
  fmt::print("{}{}", fit_table(set, fit), conditioning_text(set, fit));
  if (!command.log.empty()) fmt::print("{}", residual_parts_text(residual_parts(record, fit)));
  write_findings(experiment, command, set, fit);
  return kExitOk;
}

void add_source_options(CLI::App& command, Command& options) {
  auto* log = command.add_option(
      "--log", options.log,
      "identify from this LCM log (softarm import, lcm-logger) instead of steps");
  command
      .add_flag("--live", options.live,
                "play the steps over LCM on the running plant or hardware, within the limits of "
                "the section identification; Ctrl-C vents")
      ->excludes(log);
  const std::map<std::string, LoggedInput> inputs = {{"commanded", LoggedInput::commanded},
                                                     {"measured", LoggedInput::measured}};
  command.add_option("--input", options.input, "pressures of the log: commanded or measured")
      ->transform(CLI::CheckedTransformer(inputs));
  command.add_option("--from", options.from_s, "begin in the log, s after its first frame");
  command.add_option("--to", options.to_s, "end in the log (default: its end)");
  command.add_option("--skip", options.skip_s, "simulate so many s before comparing");
  command.add_option("--apart", options.apart_s, "take frames of the log at least so many s apart")
      ->check(number_between(0.0, 10.0));
  command
      .add_option("--bend", options.plan.bend_rad,
                  "with actuation by torque: largest step, as the bend in rad that the "
                  "configured stiffness would allow")
      ->check(number_between(0.01, 3.0))
      ->capture_default_str();
}

void add_choice_options(CLI::App& command, Command& options) {
  command.add_flag("--per-segment", options.choice.per_segment,
                   "k and beta of every segment instead of one for all");
  const std::map<std::string, GainSharing> sharing = {{"arm", GainSharing::arm},
                                                      {"side", GainSharing::side},
                                                      {"segment", GainSharing::segment},
                                                      {"chamber", GainSharing::chamber}};
  command
      .add_option("--gains", options.choice.gains,
                  "gains of their own for: arm, side, segment or (default) chamber")
      ->transform(CLI::CheckedTransformer(sharing));
  command.add_flag("--no-stiffness", options.no_stiffness,
                   "k as configured: for slow motion, which tells ratios only");
  command.add_flag("--no-damping", options.no_damping, "beta as configured");
  command.add_flag("--no-inertia", options.no_inertia,
                   "leave inertia out, for motions so slow that it does not count: much quicker "
                   "where beta is large");
  command.add_flag("--no-lag", options.no_lag, "the lag is identification.lag_s");
  command.add_flag("--no-delay", options.no_delay, "the delay is identification.delay_s");
  command.add_flag("--rest", options.choice.rest, "seek where the springs rest");
  command.add_flag("--cubic", options.choice.cubic, "seek a cubic stiffness");
  command.add_flag("--directions", options.choice.directions,
                   "seek the direction into which every chamber pushes");
  command
      .add_option("--prior", options.options.refinement.prior,
                  "how far, in parts of it, every number may be off what is configured (one "
                  "standard deviation); 0: nothing is known before")
      ->check(number_between(0.0, 1e6))
      ->capture_default_str();
}

}  // namespace

void add_identify_command(CLI::App& app) {
  auto options = std::make_shared<Command>();
  CLI::App* command = app.add_subcommand(
      "identify", "Stiffness, damping, gains and lag from steps or from a recorded motion");
  command->add_option("CONFIG", options->config, "experiment in YAML")->required();
  command->add_option("--output", options->output,
                      "write an experiment that includes CONFIG and has the values found");
  command->add_option("--out", options->out, "folder for what plots need");
  add_source_options(*command, *options);
  add_choice_options(*command, *options);
  command->add_flag("--linear", options->linear,
                    "linear least squares alone: quick, biased by noise and smoothing");
  command->add_flag("--predict", options->predict,
                    "identify nothing: how well does CONFIG predict the motion?");
  command->add_flag("--compare", options->compare,
                    "what each term more buys, on the whole record and from half to half");
  auto* hold = command->add_option("--hold", options->plan.hold_s, "time between steps in s")
                   ->check(number_between(0.1, 100.0));
  command
      ->add_option("--longest-lag", options->options.longest_lag_s,
                   "longest lag in s that the start of the search considers")
      ->check(number_between(0.0, 100.0))
      ->capture_default_str();
  command
      ->add_option("--window", options->options.window_s,
                   "width in s of the window that smooths for the start")
      ->check(number_between(0.005, 10.0))
      ->capture_default_str();
  auto* seed = command
                   ->add_option("--seed", options->seed,
                                "seed of noise and dropouts (default: the configuration's)")
                   ->check(CLI::NonNegativeNumber);
  auto* seeds = command
                    ->add_option("--seeds", options->study.seeds,
                                 "do it on so many arms drawn at random, and print how often the "
                                 "intervals hold the truth")
                    ->check(CLI::Range(1, 100000))
                    ->excludes("--live");
  command
      ->add_option("--spread", options->study.spread,
                   "with --seeds: how far the truth is off the configured, at most")
      ->check(number_between(0.0, 0.9))
      ->capture_default_str();
  command->callback([options, seed, seeds, hold] {
    options->has_seed = seed->count() > 0;
    options->has_hold = hold->count() > 0;
    options->coverage = seeds->count() > 0;
    options->study.window_s = options->options.window_s;
    int code = identify(*options);
    if (!options->damage.empty()) {
      print_error("softarm", options->log + ": " + options->damage);
      if (code == kExitOk) code = kExitData;
    }
    if (code != kExitOk) throw CLI::RuntimeError(code);
  });
}

}  // namespace softarm
