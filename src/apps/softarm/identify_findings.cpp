// softarm identify: what it writes, and the choice of terms.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/softarm/identify_parts.hpp"
#include "softarm/base/version.hpp"
#include "softarm/commissioning/identification/fit_report.hpp"
#include "softarm/commissioning/identification/term_selection.hpp"
#include "softarm/config/load.hpp"

namespace softarm {

Findings::Findings(const Experiment& of, const IdentifyCommand& command) {
  Files inputs = of.files;
  for (const auto* logs : {&command.logs, &command.held_out})
    for (const std::string& log : *logs) inputs.emplace_back(log);
  if (!command.output.empty()) experiment.emplace(command.output, inputs);
  if (command.out.empty()) return;
  std::filesystem::create_directories(command.out);
  residuals.emplace(std::filesystem::path(command.out) / "identification.csv", inputs);
}

void write_findings(const Experiment& experiment, const IdentifyCommand& command,
                    const ArmHypothesis& arm, const Refinement& fit, Findings& findings) {
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
      command.live           ? "steps on the running arm"
      : command.logs.empty() ? "steps on the simulated arm"
                             : fmt::format("{}", fmt::join(command.logs, ", ")),
      1e3 * fit.rms_rad, 1e3 * fit.motion_rms_rad);
  OutputFile& output = *findings.experiment;
  write_experiment(output, identified_yaml(experiment, arm, command.choice, note, command.config,
                                           output.partial()));
  fmt::print("{} has the values found: softarm run {}\n", command.output, command.output);
}

void print_lengths(const ArmHypothesis& arm, const Experiment& experiment, MotionRecord record,
                   const std::string& what) {
  if (!arm.elongation.given() || record.chord_m.rows() == 0) return;
  FitChoice lengths;
  lengths.elongation = lengths.chamber_lags = true;  // every lag as it is
  const ResponseModel model(record);
  Eigen::MatrixXd u;  // no measured one enters
  if (!model.simulate(arm, model.longest_step_s(arm), u)) return;
  record.u_rad = u;
  const ParameterSet set(arm, experiment.actuation.kind, lengths);
  const Refinement it = predict(set, record, set.of(arm));
  fmt::print("{}: to {:.4g} mm rms a segment, of a motion of {:.4g} mm\n", what, 1e3 * it.rms_rad,
             1e3 * it.motion_rms_rad);
}

void print_held_out(const ArmHypothesis& arm, const Experiment& experiment,
                    const std::vector<MotionRecord>& held_out, const IdentifyCommand& command) {
  FitChoice as_it_is = command.choice;
  as_it_is.directions = false;
  as_it_is.inertia = arm.inertia;
  const ParameterSet set(arm, experiment.actuation.kind, as_it_is);
  for (std::size_t i = 0; i < held_out.size(); ++i) {
    const Refinement it = predict(set, held_out[i], set.of(arm));
    fmt::print("{}, held out: predicted to {:.4g} mrad rms a component, of a motion of {:.4g}\n",
               command.held_out[i], 1e3 * it.rms_rad, 1e3 * it.motion_rms_rad);
    print_lengths(arm, experiment, held_out[i], "its lengths");
  }
}

int choose_terms(const Experiment& experiment, IdentifyCommand& command,
                 const std::vector<MotionRecord>& records,
                 const std::vector<MotionRecord>& held_out, Findings& findings) {
  std::vector<Fold> folds;
  for (const MotionRecord& each : held_out) folds.push_back({records, each});
  if (folds.empty()) folds = folds_of(records);
  SelectionOptions options;
  options.identify = command.options;
  const ArmHypothesis start = configured(experiment);
  const ActuationKind kind = experiment.actuation.kind;
  SelectedModel bend;
  std::optional<SelectedModel> lengths;
  {
    Progress progress;
    options.progress = [&](const std::string& text) { progress.update(text); };
    if (command.stretch) {
      SelectedArm found = select_arm(start, kind, command.choice, records, folds, options);
      bend = std::move(found.bend);
      lengths = std::move(found.lengths);
    } else {
      bend = select_terms(start, kind, command.choice, records, folds, options);
    }
  }
  command.choice = bend.choice;
  fmt::print("{}", selection_text(bend, bend.whole.motion_rms_rad, 1e3, "mrad"));
  if (lengths)
    fmt::print("\nlengths\n{}", selection_text(*lengths, lengths->whole.motion_rms_rad, 1e3, "mm"));
  const ParameterSet set(bend.arm, kind, bend.choice);
  fmt::print("\nas chosen, on all that was given:\n{}", fit_table(set, bend.whole));
  print_held_out(bend.arm, experiment, held_out, command);
  write_findings(experiment, command, bend.arm, bend.whole, findings);
  return kExitOk;
}

}  // namespace softarm
