#include "softarm/commissioning/calibration/rest_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "softarm/base/time.hpp"
#include "softarm/client/arm_client.hpp"
#include "softarm/transport/mocap_source.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kPatience_ns = 5'000'000'000;
constexpr std::int64_t kLook_ns = 50'000'000;
constexpr double kNoPressure_bar = 0.01;

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

}  // namespace

std::vector<MocapFrame> record_rest(const Experiment& experiment, double duration_s,
                                    const std::function<bool()>& stop,
                                    const std::function<void(const std::string&)>& progress) {
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
  const std::int64_t begin_ns = client.now_ns();
  for (std::int64_t now_ns = begin_ns; !stop(); now_ns = client.now_ns()) {
    if (frames.empty() && now_ns - begin_ns > kPatience_ns)
      throw std::runtime_error(fmt::format(
          "no frame on {} for {} s: is motion capture running, and are "
          "transport.mocap.source and "
          "daemon.lcm.url right? {} messages came that are not of this source",
          mocap_place(experiment.transport), kPatience_ns / 1'000'000'000, client.not_frames()));
    if (!frames.empty() && now_ns - first_ns >= to_ns(duration_s)) return frames;
    if (most_bar > kNoPressure_bar)
      throw std::runtime_error(
          fmt::format("the arm is under pressure ({:.3f} bar commanded): expected none; softarm "
                      "disarm, or end what commands it",
                      most_bar));
    client.update(now_ns + kLook_ns);
    progress(fmt::format("{} frames of {:g} s", frames.size(), duration_s));
  }
  throw std::runtime_error("stopped");
}

}  // namespace softarm
