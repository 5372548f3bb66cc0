// A row of softarm-dev bench robustness over LCM: softarmd and softarm-plant as they run beside an
// arm, and a relay between them where frames are to be lost.
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include "apps/child_process.hpp"
#include "dev/bench/robustness_scenes.hpp"
#include "dev/bench/temporary_folder.hpp"
#include "dev/fault/fault_relay.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/config/load.hpp"
#include "softarm/recording/status_record.hpp"
#include "softarm/transport/lcm_node.hpp"

namespace softarm {
namespace {

namespace fs = std::filesystem;

/// Until ACTIVE, and for what a busy machine may take longer.
constexpr double kPatience_s = 30.0;

/// What the faults of a scene do to frames now.
Fault fault_at(const FrameFaults& faults, std::int64_t now_ns) {
  const double since_s = to_seconds(now_ns % 1'000'000'000);
  if (since_s < faults.lost_s) return {.kind = FaultKind::stop};
  if (since_s < faults.occluded_s) return {.kind = FaultKind::occlude, .body = 2};
  return {};
}

}  // namespace

RobustnessTrial run_processes(const Experiment& asked, const RobustnessScene& scene,
                              std::uint64_t seed) {
  const TemporaryFolder folder;
  setenv("XDG_STATE_HOME", folder.path().c_str(), 1);  // of the daemon
  Experiment e = asked;
  e.seed = e.plant.seed = seed;
  e.transport.lcm.url = own_network();
  e.run.tracking_from_s = scene.counted_from_s;
  const fs::path config = folder.path() / "scene.yaml";
  std::ofstream(config) << resolved_text(e);
  const Experiment loaded = load_experiment(config);

  StatusRecord record(loaded, {});
  LcmNode node(loaded.transport.lcm.url);
  const LcmSettings& lcm = loaded.transport.lcm;
  bool began = false;
  RobustnessTrial trial;
  for (const std::string& channel : {lcm.status_channel, lcm.plant_channel, lcm.observer_channel})
    node.subscribe(channel, 1024, [&, channel](const ReceivedMessage& packet) {
      if (!record.take(channel, packet.bytes)) return;
      const bool active = record.status().mode == Mode::active;
      trial.stayed_active &= active || !began;
      began |= active;
    });
  std::vector<std::string> plant_arguments = {config.string()};
  std::optional<FaultRelay> relay;
  if (scene.faults.lost_s > 0.0 || scene.faults.occluded_s > 0.0) {
    plant_arguments.insert(plant_arguments.end(), {"--sensor-suffix", kSensorSuffix});
    relay.emplace(lcm, kSensorSuffix);
  }
  ChildProcess plant(program_beside_this("softarm-plant"), plant_arguments,
                     folder.path() / "plant.txt");
  ChildProcess daemon(program_beside_this("softarmd"), {config.string()},
                      folder.path() / "daemon.txt");
  const double until_s = scene.counted_from_s + scene.counted_s;
  const std::int64_t end_ns = monotonic_now_ns() + to_ns(until_s + kPatience_s);
  while (record.active_s() < until_s && monotonic_now_ns() < end_ns) {
    if (relay && began) relay->set(fault_at(scene.faults, monotonic_now_ns()));
    node.wait_until(monotonic_now_ns() + 10'000'000);
  }
  for (ChildProcess* each : {&daemon, &plant}) {
    each->signal(SIGTERM);
    each->wait(std::chrono::seconds(5));
  }
  record.close();
  trial.stayed_active &= record.active_s() >= until_s;
  const TrackingSummary& summary = record.summary();
  trial.u_rms_rad = summary.u_rms_rad();
  trial.u_largest_rad = summary.u_max_rad();
  trial.tip_rms_m = summary.tip_rms_m();
  trial.nis = summary.nis();
  trial.surprised = summary.surprised_fraction();
  trial.pressure_rate_bar_per_s = trial.tick_us = trial.frame_tick_us =
      std::numeric_limits<double>::quiet_NaN();
  if (!began)
    throw std::runtime_error(scene.name + ": the arm was never ACTIVE\n" + daemon.printed() +
                             plant.printed());
  return trial;
}

}  // namespace softarm
