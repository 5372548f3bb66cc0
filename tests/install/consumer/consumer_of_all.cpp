// Links every room and the messages: a dependency that the package forgot to find shows here.
#include <cstdio>
#include <softarm/config/experiment.hpp>
#include <softarm_messages/pressure_command_t.hpp>

int main() {
  const softarm::Experiment experiment;
  softarm_messages::pressure_command_t command;
  command.num_chambers = 0;
  std::printf("%g Hz, a message of %d bytes\n", experiment.daemon.rate_hz,
              command.getEncodedSize());
  return command.getEncodedSize() > 0 ? 0 : 1;
}
