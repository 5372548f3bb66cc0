// softarm-dev bench plant: integrators, real-time factor beside error.
#include <cstdio>
#include <memory>
#include <string>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "dev/bench/plant_report.hpp"
#include "dev/commands.hpp"

namespace softarm {
namespace {

struct PlantBenchOptions {
  double duration_s = 2.0;
  int rounds = 5;
  bool json = false;
};

void bench(const PlantBenchOptions& options) {
  std::string text;
  {
    Progress progress(true);
    const PlantReport report =
        bench_plant(options.duration_s, options.rounds,
                    [&progress](const std::string& what) { progress.update(what); });
    text = options.json ? json(report) : table(report);
  }
  std::fwrite(text.data(), 1, text.size(), stdout);
}

}  // namespace

void add_bench_plant_command(CLI::App& group) {
  auto options = std::make_shared<PlantBenchOptions>();
  CLI::App* command = group.add_subcommand(
      "plant", "Real-time factor beside error of every plant, method and tolerance");
  command->add_flag("--json", options->json, "print JSON instead of tables");
  command
      ->add_option("--duration", options->duration_s,
                   "simulated time of a run in s; half of it for arms of pieces and links")
      ->check(positive_seconds())
      ->capture_default_str();
  command->add_option("--rounds", options->rounds, "how often everything is measured")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->callback([options] { bench(*options); });
}

}  // namespace softarm
