// Calls into every module, so that whatever the installed libraries need must have been found. Its
// argument is an installed experiment.
#include <cstdio>
#include <softarm/actuation/pressure_allocator.hpp>
#include <softarm/config/load.hpp>
#include <softarm/runtime/control_pipeline.hpp>
#include <softarm/simulation/arm_plant.hpp>
#include <softarm/transport/lcm_node.hpp>
#include <softarm/valves/modbus_terminal.hpp>
#include <softarm_messages/pressure_command_t.hpp>

int main(int, char** arguments) try {
  const softarm::Experiment experiment = softarm::load_experiment(arguments[1]);
  softarm::ArmPlant plant(experiment.plant);
  plant.advance(0.01);
  softarm::LcmNode node("memq://");
  const softarm::ModbusTerminal terminal(experiment.valves);
  softarm_messages::pressure_command_t command;
  command.num_chambers = 0;
  std::printf("%s: %d chambers, %d bytes in a message\n", experiment.name.c_str(), plant.chambers(),
              command.getEncodedSize());
  return plant.chambers() > 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
