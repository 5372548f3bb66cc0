// softarm identify: stiffness, damping and gains of the PCC model, as in the paper's section
// VII-B1: from steps played on the simulated arm, in lock step or over LCM, or from a recorded log.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/commands.hpp"
#include "apps/softarm/identify_options.hpp"
#include "softarm/base/output_file.hpp"
#include "softarm/base/version.hpp"
#include "softarm/commissioning/identification/fit_report.hpp"
#include "softarm/commissioning/identification/live_experiment.hpp"
#include "softarm/commissioning/identification/model_comparison.hpp"
#include "softarm/commissioning/identification/residual_parts.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

int threads() { return static_cast<int>(std::max(1U, std::thread::hardware_concurrency())); }

MotionRecord play(const Experiment& experiment, const IdentifyCommand& command) {
  catch_stop_signals();
  ignore_broken_pipes();
  Progress progress(true);
  const LiveOutcome outcome = play_steps(
      experiment, command.plan, [] { return stop_requested != 0; },
      [&](const std::string& text) { progress.update(text); });
  release_stop_signals();  // the arm no longer moves
  if (!outcome.aborted.empty())
    throw std::runtime_error("vented, nothing identified: " + outcome.aborted);
  return outcome.record;
}

MotionRecord record_of(const Experiment& experiment, IdentifyCommand& command) {
  if (command.live) return play(experiment, command);
  if (command.log.empty()) return record_step_response(experiment, command.plan);
  const LoggedMotion logged = read_log(experiment, command.log, command.input);
  command.damage = logged.damage;
  if (!logged.notes.empty())
    say(fmt::format("softarm: warning: {}: {}\n", command.log, logged.notes));
  MotionRecord record = logged.record;
  const double end_s = record.time_s[record.time_s.size() - 1] + 1e-6;
  const double to_s = command.to_s > 0.0 ? std::min(command.to_s, end_s) : end_s;
  record = record.part(command.from_s, to_s, 0.0);
  record.scored_from_s = std::max(logged.record.scored_from_s, command.from_s + command.skip_s);
  if (command.apart_s > 0.0) record = record.thinned(command.apart_s);
  return record;
}

int print_coverage(const Experiment& experiment, const IdentifyCommand& command) {
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

/// The files to write; opened before the arm moves, so that a wrong name is refused before.
struct Findings {
  std::optional<OutputFile> residuals, experiment;

  Findings(const Experiment& of, const IdentifyCommand& command) {
    Files inputs = of.files;
    if (!command.log.empty()) inputs.emplace_back(command.log);
    if (!command.output.empty()) experiment.emplace(command.output, inputs);
    if (command.out.empty()) return;
    std::filesystem::create_directories(command.out);
    residuals.emplace(std::filesystem::path(command.out) / "identification.csv", inputs);
  }
};

void write_findings(const Experiment& experiment, const IdentifyCommand& command,
                    const ParameterSet& set, const Refinement& fit, Findings& findings) {
  if (findings.residuals) {
    findings.residuals->write(residuals_csv(fit));
    findings.residuals->commit();
    fmt::print("{} has the measured and simulated motion: tools/plot_identification.py {}\n",
               (std::filesystem::path(command.out) / "identification.csv").string(), command.out);
  }
  if (!findings.experiment) return;
  const std::string note = fmt::format(
      "Identified by softarm {} from {}: residual {:.3g} mrad rms of a motion of {:.3g} mrad rms.",
      version_text(),
      command.live          ? "steps on the running arm"
      : command.log.empty() ? "steps on the simulated arm"
                            : command.log,
      1e3 * fit.rms_rad, 1e3 * fit.motion_rms_rad);
  OutputFile& output = *findings.experiment;
  output.write(identified_yaml(experiment, set.arm(fit.x), command.choice, note, command.config,
                               output.partial()));
  output.flush();
  load_experiment(output.partial());
  output.commit();
  fmt::print("{} has the values found: softarm run {}\n", command.output, command.output);
}

int identify(IdentifyCommand& command) {
  Experiment experiment = load_experiment(command.config);
  if (command.has_seed) experiment.seed = experiment.plant.seed = command.seed;
  if (!command.has_hold) command.plan.hold_s = experiment.identification.hold_s;
  command.choice.lag = !command.no_lag;
  command.choice.delay = !command.no_delay;
  command.choice.stiffness = !command.no_stiffness;
  command.choice.damping = !command.no_damping;
  command.choice.inertia = !command.no_inertia;
  if (command.coverage) return print_coverage(experiment, command);
  // Checked before the arm moves, not after.
  const auto folder = (std::filesystem::path(".") / command.output).parent_path();
  if (!std::filesystem::is_directory(folder)) {
    print_error("softarm", fmt::format("--output: there is no folder {}", folder.string()));
    return kExitUsage;
  }
  Findings findings(experiment, command);

  const MotionRecord record = record_of(experiment, command);
  const ParameterSet set(configured(experiment), experiment.actuation.kind, command.choice);
  if (command.linear) {
    const LinearFit fit = fit_linear_and_lag(
        set, record, set.configured(), command.options.window_s, command.options.longest_lag_s);
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
    write_findings(experiment, command, set, fit, findings);
    return kExitOk;
  }
  if (command.predict) {
    const Refinement fit = predict(set, record, set.of(configured(experiment)));
    fmt::print(
        "{} predicts u to {:.4g} mrad rms a component; the motion's own is {:.4g} mrad rms "
        "about its mean\n",
        command.config, 1e3 * fit.rms_rad, 1e3 * fit.motion_rms_rad);
    write_findings(experiment, command, set, fit, findings);
    return kExitOk;
  }
  const Refinement fit = softarm::identify(set, record, command.options);
  fmt::print("{}{}", fit_table(set, fit), conditioning_text(set, fit));
  if (!command.log.empty()) fmt::print("{}", residual_parts_text(residual_parts(record, fit)));
  write_findings(experiment, command, set, fit, findings);
  return kExitOk;
}

}  // namespace

void add_identify_command(CLI::App& app) {
  auto options = std::make_shared<IdentifyCommand>();
  CLI::App* command = app.add_subcommand(
      "identify", "Stiffness, damping, gains and lag from steps or from a recorded motion");
  add_identify_options(*command, *options);
  command->callback([options, command] {
    options->has_seed = command->count("--seed") > 0;
    options->has_hold = command->count("--hold") > 0;
    options->coverage = command->count("--seeds") > 0;
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
