// softarm calibrate: looks at an arm that hangs still and finds where on its marker plates the
// frames of the segments sit.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <stdexcept>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/commands.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/base/version.hpp"
#include "softarm/commissioning/calibration/rest_calibration.hpp"
#include "softarm/config/load.hpp"
#include "softarm/recording/experiment_log.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/mocap_source.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kPatience_ns = 5'000'000'000;
constexpr std::int64_t kLook_ns = 50'000'000;
constexpr int kCapacity = 1024;
constexpr float kNoPressure_bar = 0.01F;

struct CalibrateOptions {
  std::string config, output;
  double duration_s = 5.0;
  BaseSource base = BaseSource::plate;
};

/// Body poses: what the source sends, in our world, without plates.
TransportSettings without_plates(TransportSettings transport) {
  const auto clear = [](PlateSettings& plate) {
    plate.position_m.setZero();
    plate.rotation_rad.setZero();
  };
  clear(transport.bodies.base_plate);
  for (PlateSettings& plate : transport.bodies.segment_plates) clear(plate);
  return transport;
}

class Watcher {
 public:
  explicit Watcher(const Experiment& experiment)
      : mocap_(without_plates(experiment.transport), experiment.safety, experiment.arm),
        node_(experiment.transport.lcm.url) {
    for (std::size_t k = 0; k < mocap_.channels().size(); ++k)
      node_.subscribe(mocap_.channels()[k], kCapacity,
                      [this, k](const ReceivedMessage& packet) { take(k, packet); });
    node_.subscribe(experiment.transport.lcm.command_channel, kCapacity,
                    [this](const ReceivedMessage& packet) { take_command(packet); });
  }

  /// Frames of `duration_s`, counted from the first.
  std::vector<MocapFrame> watch(double duration_s) {
    Progress progress;
    const std::int64_t begin_ns = monotonic_now_ns();
    const auto span_ns = to_ns(duration_s);
    for (std::int64_t now_ns = begin_ns; stop_requested == 0; now_ns = monotonic_now_ns()) {
      if (frames_.empty() && now_ns - begin_ns > kPatience_ns)
        throw std::runtime_error(
            fmt::format("no frame on {} for {} s: is motion capture running, and are "
                        "transport.mocap.source and "
                        "daemon.lcm.url right? {} messages came that are not of this source",
                        mocap_.channels().front(), kPatience_ns / 1'000'000'000, malformed_));
      if (!frames_.empty() && now_ns - first_ns_ >= span_ns) return std::move(frames_);
      if (most_bar_ > kNoPressure_bar)
        throw std::runtime_error(
            fmt::format("the arm is under pressure ({:.3f} bar commanded): expected none; softarm "
                        "disarm, or end what commands it",
                        most_bar_));
      node_.wait_until(now_ns + kLook_ns);
      if (MocapFrame frame; mocap_.overdue(monotonic_now_ns(), frame)) keep(frame);
      progress.update(fmt::format("{} frames of {:g} s", frames_.size(), duration_s));
    }
    throw std::runtime_error("stopped");
  }

 private:
  void take(std::size_t channel, const ReceivedMessage& packet) {
    MocapFrame frame;
    const MocapReceipt receipt = mocap_.take(channel, packet.bytes, monotonic_now_ns(), frame);
    if (receipt == MocapReceipt::malformed) ++malformed_;
    if (receipt == MocapReceipt::frame) keep(frame);
  }
  void keep(const MocapFrame& frame) {
    if (frames_.empty()) first_ns_ = monotonic_now_ns();
    frames_.push_back(frame);
  }
  void take_command(const ReceivedMessage& packet) {
    if (!decode(packet.bytes, command_) || command_.shadow != 0) return;
    for (const float bar : command_.pressure_bar) most_bar_ = std::max(most_bar_, bar);
  }

  MocapSource mocap_;
  LcmNode node_;
  std::vector<MocapFrame> frames_;
  std::int64_t first_ns_ = 0;
  std::int64_t malformed_ = 0;
  float most_bar_ = 0.0F;
  softarm_messages::pressure_command_t command_;
};

int calibrate(const CalibrateOptions& options) {
  namespace fs = std::filesystem;
  const Experiment experiment = load_experiment(options.config);
  catch_stop_signals();
  const auto frames = Watcher(experiment).watch(options.duration_s);
  const RestCalibration found = calibrate_rest(experiment, frames, options.base);
  fmt::print("{}", calibration_text(experiment, found));
  if (options.output.empty()) return kExitOk;
  const std::string note =
      fmt::format("Where S_i sits on the marker plates: softarm calibrate {}, {} frames at rest.",
                  version_text(), found.body.back().frames);
  const fs::path folder = fs::absolute(options.output).parent_path();
  write_text(options.output,
             calibrated_yaml(experiment, found, note,
                             fs::proximate(fs::absolute(options.config), folder).string()));
  load_experiment(options.output);
  fmt::print("{} has the plates: softarm check {}\n", options.output, options.output);
  return kExitOk;
}

}  // namespace

void add_calibrate_command(CLI::App& app) {
  auto* command = app.add_subcommand(
      "calibrate", "finds the marker plates' transforms from an arm that hangs still, over LCM");
  auto options = std::make_shared<CalibrateOptions>();
  command->add_option("CONFIG", options->config, "experiment in YAML")->required();
  command->add_option("--duration", options->duration_s, "how long to look, in s (default 5)")
      ->check(positive_seconds());
  command->add_option("-o,--output", options->output,
                      "write an experiment that includes CONFIG and has the plates found");
  command
      ->add_option(
          "--base", options->base,
          "what tells where the arm's axis points at the base: its plate as configured, or "
          "arm.base.rotation")
      ->transform(CLI::CheckedTransformer(std::map<std::string, BaseSource>{
          {"plate", BaseSource::plate}, {"arm", BaseSource::arm}}));
  command->callback([options] {
    if (const int code = calibrate(*options); code != kExitOk) throw CLI::RuntimeError(code);
  });
}

}  // namespace softarm
