// softarm-dev bench recordings: recordings of real arms, identified and predicted.
#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include "dev/bench/recordings_bench.hpp"
#include "dev/bench_report.hpp"
#include "dev/commands.hpp"

namespace softarm {
namespace {

struct RecordingsOptions {
  ArenaOptions arena;
  std::string data, out;
  bool json = false;
};

void measure(RecordingsOptions options) {
  options.arena.data = options.data;
  options.arena.out = options.out;
  options.arena.config = shared_file("config", SOFTARM_CONFIG_FOLDER);
  options.arena.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  print_report(options.json, [&](auto progress) {
    ArenaReport report = run_arena(options.arena, progress);
    for (const std::string& message : report.skipped) say("softarm-dev: " + message + "\n");
    if (report.rows.empty())
      throw std::runtime_error(options.data + ": expected a recording that is known, found none");
    return report;
  });
}

}  // namespace

void add_bench_recordings_command(CLI::App& group) {
  auto options = std::make_shared<RecordingsOptions>();
  CLI::App* command = group.add_subcommand(
      "recordings", "Recordings of real arms: identified, and predicted where they were not seen");
  command
      ->add_option("DATA", options->data,
                   "folder with the tables; what is absent is skipped, and a table with the "
                   "columns of a known one is predicted as its unseen partner")
      ->required()
      ->check(CLI::ExistingDirectory);
  command->add_flag("--json", options->json, "print JSON instead of a table");
  command->add_option("--out", options->out,
                      "folder for measured and predicted motions, for tools/plot_recordings.py");
  command->add_option("--only", options->arena.only, "recordings whose name contains this");
  command->callback([options] { measure(*options); });
}

}  // namespace softarm
