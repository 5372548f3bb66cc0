// softarm-dev bench: `model` is here, the others in files beside.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "dev/bench/model_report.hpp"
#include "dev/commands.hpp"

namespace softarm {
namespace {

struct BenchOptions {
  double seconds = 30.0;
  bool json = false;
  std::string golden;
};

void bench(BenchOptions options) {
  if (options.golden.empty()) {
    options.golden = shared_file("golden.json", SOFTARM_GOLDEN_FILE);
    if (!std::filesystem::exists(options.golden)) {
      print_error("softarm-dev", "no golden file where this was built; name one with --golden");
      options.golden.clear();
    }
  }
  std::string text;
  {
    Progress progress(true);
    const ModelReport report =
        bench_model(options.seconds, options.golden,
                    [&progress](const std::string& what) { progress.update(what); });
    text = options.json ? json(report) : table(report);
  }
  std::fwrite(text.data(), 1, text.size(), stdout);
}

}  // namespace

void add_bench_command(CLI::App& app) {
  auto options = std::make_shared<BenchOptions>();
  CLI::App* group = app.add_subcommand("bench", "Measure how fast this machine is");
  group->require_subcommand(1);
  add_bench_control_commands(*group);
  add_bench_robustness_command(*group);
  add_bench_plant_command(*group);
  add_bench_recordings_command(*group);
  add_bench_loop_command(*group);
  add_bench_python_command(*group);
  add_bench_mocap_command(*group);
  CLI::App* command = group->add_subcommand(
      "model", "Time and error of every route to the model's terms, for 1 to 100 segments");
  command->add_flag("--json", options->json, "print JSON instead of tables");
  command->add_option("--seconds", options->seconds, "time to measure for, in s")
      ->check(positive_seconds())
      ->capture_default_str();
  command
      ->add_option("--golden", options->golden,
                   "golden file to take errors from (default: the one that comes with softarm)")
      ->check(CLI::ExistingFile);
  command->callback([options] { bench(*options); });
}

}  // namespace softarm
