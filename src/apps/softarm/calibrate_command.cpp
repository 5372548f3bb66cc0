// softarm calibrate: observes an arm at rest and finds the marker frames: the poses of the
// segments' frames on their marker bodies.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/commands.hpp"
#include "softarm/base/output_file.hpp"
#include "softarm/base/version.hpp"
#include "softarm/client/arm_client.hpp"
#include "softarm/commissioning/calibration/rest_calibration.hpp"
#include "softarm/config/load.hpp"
#include "softarm/transport/mocap_source.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kPatience_ns = 5'000'000'000;
constexpr std::int64_t kLook_ns = 50'000'000;
constexpr double kNoPressure_bar = 0.01;

struct CalibrateOptions {
  std::string config, output;
  double duration_s = 5.0;
  BaseSource base = BaseSource::marker_frame;
};

/// Body poses: as the source sends them, in our world, without the configured marker frames.
Experiment without_marker_frames(Experiment experiment) {
  const auto clear = [](MarkerFrameSettings& frame) {
    frame.position_m.setZero();
    frame.rotation_rad.setZero();
  };
  clear(experiment.transport.bodies.base_marker_frame);
  for (MarkerFrameSettings& frame : experiment.transport.bodies.segment_marker_frames) clear(frame);
  return experiment;
}

/// Frames of an arm without pressure for `duration_s`, counted from the first.
std::vector<MocapFrame> watch(const Experiment& experiment, double duration_s) {
  std::vector<MocapFrame> frames;
  std::int64_t first_ns = 0;
  double most_bar = 0.0;
  ArmClient client(without_marker_frames(experiment));
  client.on_frame([&](const CapturedFrame& captured) {
    if (frames.empty()) first_ns = captured.arrival_ns;
    frames.push_back(captured.frame);
  });
  client.on_command([&](const ChamberCommand& command) {
    if (!command.shadow && command.pressure_bar.size() > 0)
      most_bar = std::max(most_bar, command.pressure_bar.maxCoeff());
  });
  Progress progress;
  const std::int64_t begin_ns = client.now_ns();
  for (std::int64_t now_ns = begin_ns; stop_requested == 0; now_ns = client.now_ns()) {
    if (frames.empty() && now_ns - begin_ns > kPatience_ns)
      throw std::runtime_error(
          fmt::format("no frame on {} for {} s: is motion capture running, and are "
                      "transport.mocap.source and "
                      "daemon.lcm.url right? {} messages came that are not of this source",
                      mocap_channels(experiment.transport).front(), kPatience_ns / 1'000'000'000,
                      client.not_frames()));
    if (!frames.empty() && now_ns - first_ns >= to_ns(duration_s)) return frames;
    if (most_bar > kNoPressure_bar)
      throw std::runtime_error(
          fmt::format("the arm is under pressure ({:.3f} bar commanded): expected none; softarm "
                      "disarm, or end what commands it",
                      most_bar));
    client.update(now_ns + kLook_ns);
    progress.update(fmt::format("{} frames of {:g} s", frames.size(), duration_s));
  }
  throw std::runtime_error("stopped");
}

int calibrate(const CalibrateOptions& options) {
  namespace fs = std::filesystem;
  const Experiment experiment = load_experiment(options.config);
  std::optional<OutputFile> output;  // refused before the arm is watched, not after
  if (!options.output.empty()) output.emplace(options.output, experiment.files);
  catch_stop_signals();
  const auto frames = watch(experiment, options.duration_s);
  const RestCalibration found = calibrate_rest(experiment, frames, options.base);
  fmt::print("{}", calibration_text(experiment, found));
  if (!output) return kExitOk;
  const std::string note = fmt::format(
      "Marker frames, S_i on the marker bodies: softarm calibrate {}, {} frames at rest.",
      version_text(), found.body.back().frames);
  const fs::path folder = fs::absolute(output->partial()).parent_path();
  output->write(calibrated_yaml(experiment, found, note,
                                fs::proximate(fs::absolute(options.config), folder).string()));
  output->flush();
  load_experiment(output->partial());
  output->commit();
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
      ->transform(CLI::CheckedTransformer(std::map<std::string, BaseSource>{
          {"plate", BaseSource::marker_frame}, {"arm", BaseSource::arm}}));
  command->callback([options] {
    if (const int code = calibrate(*options); code != kExitOk) throw CLI::RuntimeError(code);
  });
}

}  // namespace softarm
