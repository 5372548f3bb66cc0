// softarm calibrate: observes an arm at rest and finds the marker frames: the poses of the
// segments' frames on their marker bodies.
#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <optional>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/commands.hpp"
#include "softarm/base/output_file.hpp"
#include "softarm/base/version.hpp"
#include "softarm/commissioning/calibration/rest_calibration.hpp"
#include "softarm/commissioning/calibration/rest_recording.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

struct CalibrateOptions {
  std::string config, output;
  double duration_s = 5.0;
  BaseSource base = BaseSource::marker_frame;
};

int calibrate(const CalibrateOptions& options) {
  namespace fs = std::filesystem;
  const Experiment experiment = load_experiment(options.config);
  std::optional<OutputFile> output;  // refused before the arm is watched, not after
  if (!options.output.empty()) output.emplace(options.output, experiment.files);
  catch_stop_signals();
  Progress progress;
  const auto frames = record_rest(
      experiment, options.duration_s, [] { return stop_requested != 0; },
      [&](const std::string& text) { progress.update(text); });
  const RestCalibration found = calibrate_rest(experiment, frames, options.base);
  fmt::print("{}", calibration_text(experiment, found));
  if (!output) return kExitOk;
  const std::string note = fmt::format(
      "Marker frames, S_i on the marker bodies: softarm calibrate {}, {} frames at rest.",
      version_text(), found.body.back().frames);
  const fs::path folder = fs::absolute(output->partial()).parent_path();
  write_experiment(
      *output,
      calibrated_yaml(found, note, fs::proximate(fs::absolute(options.config), folder).string()));
  fmt::print("{} has the marker frames: softarm check {}\n", options.output, options.output);
  return kExitOk;
}

}  // namespace

void add_calibrate_command(CLI::App& app) {
  auto* command = app.add_subcommand(
      "calibrate", "finds the marker frames' transforms from an arm that hangs still, over LCM");
  auto options = std::make_shared<CalibrateOptions>();
  command->add_option("CONFIG", options->config, "experiment in YAML")->required();
  command->add_option("--duration", options->duration_s, "how long to look, in s (default 5)")
      ->check(positive_seconds());
  command->add_option("-o,--output", options->output,
                      "write an experiment that includes CONFIG and has the marker frames found");
  command
      ->add_option(
          "--base", options->base,
          "source of the arm's axis at the base: its marker frame as configured (plate), or "
          "arm.base.rotation (arm)")
      ->transform(one_word_of(std::map<std::string, BaseSource>{{"plate", BaseSource::marker_frame},
                                                                {"arm", BaseSource::arm}}));
  run_where_given(*command, [options] { return calibrate(*options); });
}

}  // namespace softarm
