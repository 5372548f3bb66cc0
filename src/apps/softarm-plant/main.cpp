// softarm-plant: the simulated arm in real time. Valve pressures in, motion-capture frames and
// measured pressures out, in the messages of the hardware; with --modbus behind the registers of a
// valve terminal.
#include <fmt/format.h>

#include <optional>
#include <string>

#include "apps/program.hpp"
#include "apps/signals.hpp"
#include "apps/softarm-plant/plant_process.hpp"
#include "softarm/base/instance_lock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/base/version.hpp"
#include "softarm/config/load.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

int serve(const std::string& path, const std::string& sensor_suffix,
          std::optional<int> modbus_port) {
  Experiment experiment = load_experiment(path);
  LcmSettings& lcm = experiment.transport.lcm;
  lcm.mocap_channel += sensor_suffix;
  lcm.measurement_channel += sensor_suffix;
  const bool by_torque = experiment.actuation.kind == ActuationKind::torque;
  if (by_torque && modbus_port)
    throw ConfigError(path, 0, "actuation.kind",
                      "chambers with --modbus: a terminal has valves, not moments", "torque");
  const InstanceLock lock(lock_name(lcm.mocap_channel, lcm.url));
  // With --modbus, softarm-valves publishes the measured pressures.
  std::optional<InstanceLock> measurement_lock;
  if (!by_torque && !modbus_port)
    measurement_lock.emplace(lock_name(lcm.measurement_channel, lcm.url));
  catch_stop_signals();
  ignore_broken_pipes();
  say(fmt::format(
      "softarm-plant {} commit {} configuration {} seed {}: {}, motion capture at {} Hz\n",
      version_text(), commit_text(), hash_text(experiment.hash), experiment.seed, experiment.name,
      experiment.plant.mocap.rate_hz));
  if (const std::string warning = network_warning(lcm.url); !warning.empty())
    say(fmt::format("softarm-plant: warning: {}\n", warning));
  PlantProcess(experiment, modbus_port).run();
  return kExitOk;
}

}  // namespace
}  // namespace softarm

int main(int argc, char** argv) {
  CLI::App app("The simulated arm in real time: valve pressures in, motion-capture frames out",
               "softarm-plant");
  std::string config, sensor_suffix;
  std::optional<int> modbus_port;
  app.add_option("CONFIG", config, "experiment in YAML")->required();
  app.add_option("--modbus", modbus_port,
                 "serve as a valve terminal at this port of 127.0.0.1 (0: any) instead of taking "
                 "commands from LCM")
      ->check(CLI::Range(0, 65535))
      ->type_name("PORT");
  app.add_option("--sensor-suffix", sensor_suffix,
                 "of the channels for motion capture and measured pressures: with _CLEAN, "
                 "softarm-dev fault can pass them on to softarmd");
  return softarm::run_program(argc, argv, app,
                              [&] { return softarm::serve(config, sensor_suffix, modbus_port); });
}
