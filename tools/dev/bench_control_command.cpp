// softarm-dev bench control, stability, softness: what a scene needs of its controller.
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "dev/bench/control_bench.hpp"
#include "dev/commands.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

struct Options {
  std::vector<std::string> configs;
  double seconds = 12.0;
  double timing_s = 1.0;
  int points = 13;
  bool json = false;
};

template <class Measure>
void measure_and_print(const Options& options, const Measure& measure) {
  std::string text;
  {
    Progress progress(true);
    const auto report = measure([&progress](const std::string& what) { progress.update(what); });
    text = options.json ? json(report) : table(report);
  }
  std::fwrite(text.data(), 1, text.size(), stdout);
}

std::string our_config(const std::string& name) {
  return shared_file("config/" + name, SOFTARM_CONFIG_FOLDER "/" + name);
}

CLI::App* add(CLI::App& group, const char* name, const char* doc, Options& options,
              std::vector<std::string> configs) {
  options.configs = std::move(configs);
  CLI::App* command = group.add_subcommand(name, doc);
  command->add_flag("--json", options.json, "print JSON instead of tables");
  command->add_option("CONFIG", options.configs,
                      "experiments (default: those that come with softarm)");
  return command;
}

}  // namespace

void add_bench_control_commands(CLI::App& group) {
  auto control = std::make_shared<Options>();
  CLI::App* command =
      add(group, "control", "Tracking error against control rate and the terms of (17), their cost",
          *control, {our_config("paper_arm.yaml"), our_config("paper_simulation.yaml")});
  command->add_option("--seconds", control->seconds, "simulated time of every run, in s")
      ->check(positive_seconds())
      ->capture_default_str();
  command->add_option("--timing", control->timing_s, "time to measure costs for, a scene, in s")
      ->check(positive_seconds())
      ->capture_default_str();
  command->callback([control] {
    measure_and_print(*control, [&](const BenchProgress& progress) {
      std::vector<ControlScene> scenes;
      for (const std::string& config : control->configs)
        scenes.push_back(
            bench_scene(load_experiment(config), control->seconds, control->timing_s, progress));
      return scenes;
    });
  });

  auto stability = std::make_shared<Options>();
  command =
      add(group, "stability", "Stability over K_P, dead time and valve lag: theory, simulation",
          *stability, {our_config("paper_arm.yaml")});
  command->add_option("--points", stability->points, "along every axis of the maps")
      ->check(CLI::Range(2, 100))
      ->capture_default_str();
  command->callback([stability] {
    measure_and_print(*stability, [&](const BenchProgress& progress) {
      std::vector<StabilityMap> maps;
      const Experiment experiment = load_experiment(stability->configs.at(0));
      for (const StabilityAxis axis : {StabilityAxis::dead_time, StabilityAxis::valve_lag})
        maps.push_back(bench_stability(experiment, axis, stability->points, progress));
      return maps;
    });
  });

  auto softness = std::make_shared<Options>();
  command = add(group, "softness", "Stiffness of the tip and tracking error, over K_P", *softness,
                {our_config("paper_arm_nominal.yaml")});
  command->callback([softness] {
    measure_and_print(*softness, [&](const BenchProgress& progress) {
      return bench_softness(load_experiment(softness->configs.at(0)), progress);
    });
  });
}

}  // namespace softarm
