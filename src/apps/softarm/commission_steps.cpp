#include "apps/softarm/commission_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/closed_loop_run.hpp"
#include "apps/softarm/live_check.hpp"
#include "apps/softarm/plots.hpp"
#include "softarm/base/output_file.hpp"
#include "softarm/base/version.hpp"
#include "softarm/commissioning/calibration/rest_calibration.hpp"
#include "softarm/commissioning/calibration/rest_recording.hpp"
#include "softarm/commissioning/first_day.hpp"
#include "softarm/commissioning/identification/identify.hpp"
#include "softarm/commissioning/identification/live_experiment.hpp"
#include "softarm/commissioning/loop_check.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

namespace fs = std::filesystem;
constexpr double kFollows = 0.2;  ///< an arm whose error is below this part of its bend follows

/// Never over one that it includes.
void write(const fs::path& file, const Experiment& from, const std::string& text) {
  OutputFile output(file, from.files);
  write_experiment(output, text);
}

std::string seen_from(const fs::path& folder, const fs::path& config) {
  return fs::proximate(fs::absolute(config), fs::absolute(folder)).string();
}

StepOutcome check_file(const CommissionSettings& settings) {
  const Experiment experiment = load_experiment(settings.config);
  if (experiment.actuation.kind == ActuationKind::torque)
    return {kExitConfiguration, {}, "an arm with chambers: this one is moved by torques"};
  std::vector<std::string> warnings = experiment_warnings(experiment);
  if (experiment.arm.size() <= 6)
    for (const std::string& text : loop_warnings(check_loop(experiment, LoopDepth::stability)))
      warnings.push_back(text);
  for (const std::string& warning : warnings) fmt::print("warning: {}\n", warning);
  for (const std::string& line : reaction_times(experiment)) fmt::print("{}\n", line);
  return {kExitOk, fmt::format("{} segments, {} chambers, {} warnings", experiment.arm.size(),
                               chamber_count(experiment.actuation), warnings.size())};
}

StepOutcome look(const fs::path& config, bool pulse) {
  const int code = check_live(load_experiment(config), {.listen_s = 3.0, .pulse = pulse});
  if (code != kExitOk && code != kExitNotChecked)
    return {code, {}, "put right what the lines marked FAIL say, then the same command again"};
  return {kExitOk, pulse ? "every chamber was filled alone; no check failed" : "no check failed"};
}

StepOutcome calibrate(const CommissionSettings& settings) {
  const Experiment experiment = load_experiment(settings.config);
  Progress progress;
  const auto frames = record_rest(
      experiment, settings.rest_s, [] { return stop_requested != 0; },
      [&](const std::string& text) { progress.update(text); });
  const RestCalibration found = calibrate_rest(experiment, frames, BaseSource::marker_frame);
  fmt::print("{}", calibration_text(experiment, found));
  write(settings.calibrated(), experiment,
        calibrated_yaml(found,
                        fmt::format("Marker frames: softarm commission {}, {} frames at "
                                    "rest.",
                                    version_text(), found.body.back().frames),
                        seen_from(settings.folder, settings.config)));
  return {kExitOk, fmt::format("marker frames from {} frames at rest in {}",
                               found.body.back().frames, settings.calibrated().string())};
}

StepOutcome identify_arm(const CommissionSettings& settings) {
  const Experiment experiment = load_experiment(settings.calibrated());
  StepPlan plan;
  plan.hold_s = experiment.identification.hold_s;
  FitChoice choice;
  choice.gains = settings.gains;
  Progress progress(true);
  const auto show = [&](const std::string& text) { progress.update(text); };
  const LiveOutcome outcome = play_steps(
      experiment, plan, [] { return stop_requested != 0; }, show);
  if (!outcome.aborted.empty())
    return {kExitFailure, {}, "vented, nothing identified: " + outcome.aborted};
  const ParameterSet set(configured(experiment), experiment.actuation.kind, choice);
  IdentifyOptions options;
  options.refinement.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  options.refinement.progress = show;
  const Refinement fit = identify(set, outcome.record, options);
  fmt::print("{}{}", fit_table(set, fit), conditioning_text(set, fit));
  const std::string found = fmt::format("residual {:.3g} mrad rms of a motion of {:.3g} mrad rms",
                                        1e3 * fit.rms_rad, 1e3 * fit.motion_rms_rad);
  write(settings.identified(), experiment,
        identified_yaml(
            experiment, set.arm(fit.x), choice,
            fmt::format("Identified by softarm commission {}: {}.", version_text(), found),
            settings.calibrated(), settings.identified()));
  return {kExitOk, found + " in " + settings.identified().string()};
}

StepOutcome follow(const CommissionSettings& settings, const char* name, double bend_rad,
                   double duration_s, const std::string& text) {
  const fs::path file = settings.motion(name);
  write(file, load_experiment(settings.identified()), text);
  const fs::path folder = settings.folder / name;
  const ClosedLoopRun run = run_closed_loop(file, folder, duration_s);
  fmt::print("{}", run.table);
  if (!run.failure.empty())
    return {kExitFailure,
            {},
            fmt::format("{}; {} has what softarmd printed", run.failure,
                        (folder / "softarmd.txt").string())};
  const std::string found = fmt::format(
      "u within {:.2f} mrad rms a segment of its reference, as "
      "estimated, at bends of {:g} rad; record in {}",
      1e3 * run.error_rms_rad, bend_rad, folder.string());
  if (!(run.error_rms_rad < kFollows * bend_rad))
    return {kExitFailure, {}, "the arm does not follow: " + found};
  draw_plots(folder);
  return {kExitOk, found};
}

StepOutcome bend(const CommissionSettings& settings) {
  const Experiment experiment = load_experiment(settings.identified());
  return follow(settings, "bend", first_bend_rad(experiment), first_bend_s(experiment),
                first_bend_yaml(experiment, settings.identified().filename()));
}

StepOutcome track(const CommissionSettings& settings) {
  const Experiment experiment = load_experiment(settings.identified());
  return follow(settings, "track", first_track_rad(experiment), settings.track_s,
                first_track_yaml(experiment, settings.identified().filename()));
}

}  // namespace

const std::vector<CommissionStep>& commission_steps() {
  using Settings = CommissionSettings;
  constexpr auto as_given = [](const Settings& it) { return it.config; };
  constexpr auto calibrated = [](const Settings& it) { return it.calibrated(); };
  constexpr auto identified = [](const Settings& it) { return it.identified(); };
  static const std::vector<CommissionStep> steps = {
      {"check", "checks the file and simulates its loop", false, as_given, check_file},
      {"look", "listens to motion capture and valves; the arm hangs still, without pressure", false,
       as_given, [](const Settings& it) { return look(it.config, false); }},
      {"calibrate", "finds the marker frames of the arm at rest", false, as_given, calibrate},
      {"pulses", "fills every chamber alone, softly, one after the other", true, calibrated,
       [](const Settings& it) { return look(it.calibrated(), true); }},
      {"identify", "plays the pressure steps of the section identification on every side", true,
       calibrated, identify_arm},
      {"bend", "starts softarmd, arms, bends one segment after the other slowly, and disarms", true,
       identified, bend},
      {"track", "starts softarmd, arms, follows the paper's trajectory (24), and disarms", true,
       identified, track},
  };
  return steps;
}

}  // namespace softarm
