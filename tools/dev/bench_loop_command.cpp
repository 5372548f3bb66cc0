// softarm-dev bench loop: the daemon's round trip and wake-ups beside a bare echo and a bare sleep.
#include <cstdio>
#include <memory>
#include <string>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "dev/bench/loop_bench.hpp"
#include "dev/commands.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

struct LoopOptions : LoopBenchOptions {
  bool json = false;
};

void bench(const LoopOptions& options) {
  load_experiment(options.config);  // errors name the file as the user did
  std::string text;
  {
    Progress progress(true);
    const LoopReport report = bench_loop(
        options, [&progress](const std::string& what) { progress.update("bench loop: " + what); });
    text = options.json ? json(report) : table(report);
  }
  std::fwrite(text.data(), 1, text.size(), stdout);
}

}  // namespace

void add_bench_loop_command(CLI::App& group) {
  auto options = std::make_shared<LoopOptions>();
  options->config = shared_file("config/paper_arm.yaml", SOFTARM_CONFIG_FOLDER "/paper_arm.yaml");
  CLI::App* command = group.add_subcommand(
      "loop", "Round trip and wake-ups of softarmd beside a bare LCM echo and a bare sleep");
  command->add_option("CONFIG", options->config, "experiment in YAML: its arm is meant")
      ->capture_default_str();
  command->add_flag("--json", options->json, "print JSON instead of tables");
  command->add_option("--seconds", options->seconds, "of each of the three scenes")
      ->check(positive_seconds())
      ->capture_default_str();
  command->add_option("--rate", options->rate_hz, "of softarmd and of the bare sleep, in Hz")
      ->check(number_between(10.0, 5000.0))
      ->capture_default_str();
  command->add_option("--busy", options->busy_processes, "busy processes of the loaded scene")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  command->add_option("--cpu", options->cpu, "pin softarmd and its rivals to it; -1: not pinned")
      ->check(CLI::Range(-1, 1023))
      ->capture_default_str();
  command->add_flag("--law", options->law, "softarmd asks a control law in another process");
  command->callback([options] { bench(*options); });
}

}  // namespace softarm
