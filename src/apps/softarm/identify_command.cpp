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
#include "apps/softarm/identify_parts.hpp"
#include "softarm/commissioning/identification/fit_report.hpp"
#include "softarm/commissioning/identification/misfit.hpp"
#include "softarm/commissioning/identification/model_comparison.hpp"
#include "softarm/commissioning/identification/residual_parts.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

int print_coverage(const Experiment& experiment, const IdentifyCommand& command) {
  catch_stop_signals();
  Progress progress(true);
  CoverageStudy study = command.study;
  study.threads = identify_threads();
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

int identify(IdentifyCommand& command) {
  Experiment experiment = load_experiment(command.config);
  if (command.has_seed) experiment.seed = experiment.plant.seed = command.seed;
  if (!command.has_hold) command.plan.hold_s = experiment.identification.hold_s;
  command.choice.lag = !command.no_lag;
  command.choice.delay = !command.no_delay;
  command.choice.stiffness = !command.no_stiffness;
  command.choice.damping = !command.no_damping;
  command.choice.inertia = experiment.identification.inertia && !command.no_inertia;
  if (command.coverage) return print_coverage(experiment, command);
  // Checked before the arm moves, not after.
  const auto folder = (std::filesystem::path(".") / command.output).parent_path();
  if (!std::filesystem::is_directory(folder))
    return fail("softarm", kExitUsage,
                fmt::format("--output: there is no folder {}", folder.string()));
  Findings findings(experiment, command);

  const std::vector<MotionRecord> records = records_of(experiment, command);
  const MotionRecord& record = records.front();
  std::vector<MotionRecord> held_out;
  for (const std::string& log : command.held_out)
    held_out.push_back(record_of(experiment, log, command));
  if (records.size() > 1 && (command.linear || command.compare))
    return fail("softarm", kExitUsage,
                "several logs: expected neither --linear nor --compare; --choose-terms "
                "compares terms on several logs");
  const ParameterSet set(configured(experiment), experiment.actuation.kind, command.choice);
  if (command.linear) {
    const LinearFit fit = fit_linear_and_lag(
        set, record, set.configured(), command.options.window_s, command.options.longest_lag_s);
    fmt::print("{}", linear_table(set, fit));
    return kExitOk;
  }
  command.options.refinement.threads = identify_threads();
  if (command.choose) return choose_terms(experiment, command, records, held_out, findings);
  Progress progress;
  command.options.refinement.progress = [&](const std::string& text) { progress.update(text); };
  if (command.compare) {
    const ModelComparison comparison =
        compare_models(experiment, record, command.choice, command.options,
                       [&](const std::string& text) { progress.update(text); });
    const Refinement& fit = comparison.trials.back().result.whole;
    fmt::print("{}\nas asked, on the whole record:\n{}{}", comparison_text(comparison),
               fit_table(set, fit), residual_parts_text(residual_parts(record, fit)));
    for (const ModelTrial& trial : comparison.trials) {
      if (held_out.empty() || trial.result.found.empty()) continue;
      fmt::print("{}, as found on the whole record\n", trial.name);
      print_held_out(trial.result.found.front(), experiment, held_out, command);
    }
    write_findings(experiment, command, set.arm(fit.x), fit, findings);
    return kExitOk;
  }
  if (command.predict) {
    const Refinement fit = predict(set, record, set.of(configured(experiment)));
    fmt::print(
        "{} predicts u to {:.4g} mrad rms a component; the motion's own is {:.4g} mrad rms "
        "about its mean\n",
        command.config, 1e3 * fit.rms_rad, 1e3 * fit.motion_rms_rad);
    print_lengths(configured(experiment), experiment, record, "the lengths");
    write_findings(experiment, command, set.arm(fit.x), fit, findings);
    return kExitOk;
  }
  Refinement fit = softarm::identify(set, records, command.options);
  const Misfit misfit = judge_misfit(configured(experiment), experiment.actuation.kind,
                                     command.choice, records, fit, command.options.refinement);
  widen(misfit, fit);
  fmt::print("{}{}{}", fit_table(set, fit), conditioning_text(set, fit), misfit_text(misfit));
  if (command.logs.size() == 1) fmt::print("{}", residual_parts_text(residual_parts(record, fit)));
  print_held_out(set.arm(fit.x), experiment, held_out, command);
  write_findings(experiment, command, set.arm(fit.x), fit, findings);
  return kExitOk;
}

}  // namespace

int identify_threads() {
  return static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

void add_identify_command(CLI::App& app) {
  auto options = std::make_shared<IdentifyCommand>();
  CLI::App* command = app.add_subcommand(
      "identify", "Stiffness, damping, gains and lag from steps or from a recorded motion");
  add_identify_options(*command, *options);
  run_where_given(*command, [options, command] {
    options->has_seed = command->count("--seed") > 0;
    options->has_hold = command->count("--hold") > 0;
    options->coverage = command->count("--seeds") > 0;
    options->study.window_s = options->options.window_s;
    const int code = identify(*options);
    if (options->damage.empty()) return code;
    print_error("softarm", options->damage);
    return code == kExitOk ? int{kExitData} : code;
  });
}

}  // namespace softarm
