// Records five seconds of a running arm in an LCM log, reads them again, and prints how it went.
//
//   record_and_summarise config/paper_arm.yaml run.log
#include <cstdio>
#include <exception>
#include <fstream>
#include <softarm/client/arm_client.hpp>
#include <softarm/config/load.hpp>
#include <softarm/recording/status_record.hpp>

using namespace softarm;

int main(int argc, char** argv) try {
  if (argc != 3) return std::fprintf(stderr, "usage: %s EXPERIMENT.yaml LOG\n", argv[0]), 64;
  const Experiment experiment = load_experiment(argv[1]);
  ArmClient arm(experiment);
  if (!arm.wait_for([&] { return arm.status() && arm.status()->mode == Mode::active; }, 10.0))
    return std::fprintf(stderr, "not ACTIVE: %s\n", arm.daemon_text().c_str()), 1;
  arm.record(argv[2]);  // all messages of this arm, as lcm-logger would
  arm.wait_for([] { return false; }, 5.0);
  arm.stop_recording();

  std::ifstream file(argv[2], std::ios::binary);
  EventLogReader log(file);
  StatusRecord record(experiment, "");  // a folder here gets log.csv, summary.json, timing.json
  for (LogEvent event; log.next(event);) record.take(event.channel, event.data);
  record.close();
  std::printf("%s", record.table().c_str());
  if (log.damage_count() > 0) std::printf("%s\n", log.damage_text().c_str());
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
