// softarm-dev bench: those that have some options and a report; the others are in files beside.
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "dev/bench/control_bench.hpp"
#include "dev/bench/loop_bench.hpp"
#include "dev/bench/model_report.hpp"
#include "dev/bench/plant_report.hpp"
#include "dev/bench_report.hpp"
#include "dev/commands.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

struct Options {
  std::vector<std::string> configs;
  std::string golden;
  double seconds = 30.0;
  double timing_s = 1.0;
  int points = 13, rounds = 5;
  bool json = false;
};

/// A sub-command with --json.
CLI::App* add(CLI::App& group, const char* name, const char* doc, bool& json) {
  CLI::App* command = group.add_subcommand(name, doc);
  command->add_flag("--json", json, "print JSON instead of tables");
  return command;
}

/// The same, on experiments.
CLI::App* add(CLI::App& group, const char* name, const char* doc, Options& options,
              std::vector<std::string> configs) {
  options.configs = std::move(configs);
  CLI::App* command = add(group, name, doc, options.json);
  command->add_option("CONFIG", options.configs,
                      "experiments (default: those that come with softarm)");
  return command;
}

void add_time(CLI::App& command, const char* name, double& time_s, const char* doc) {
  command.add_option(name, time_s, doc)->check(positive_seconds())->capture_default_str();
}

std::string golden_file(const std::string& asked) {
  if (!asked.empty()) return asked;
  const std::string golden = shared_file("golden.json", SOFTARM_GOLDEN_FILE);
  if (std::filesystem::exists(golden)) return golden;
  print_error("softarm-dev", "no golden file where this was built; name one with --golden");
  return {};
}

void add_model(CLI::App& group) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add(
      group, "model", "Time and error of every route to the model's terms, for 1 to 100 segments",
      options->json);
  add_time(*command, "--seconds", options->seconds, "time to measure for, in s");
  command
      ->add_option("--golden", options->golden,
                   "golden file to take errors from (default: the one that comes with softarm)")
      ->check(CLI::ExistingFile);
  command->callback([options] {
    print_report(options->json, [golden = golden_file(options->golden), &options](auto progress) {
      return bench_model(options->seconds, golden, progress);
    });
  });
}

void add_plant(CLI::App& group) {
  auto options = std::make_shared<Options>();
  options->seconds = 2.0;
  CLI::App* command =
      add(group, "plant", "Real-time factor beside error of every plant, method and tolerance",
          options->json);
  add_time(*command, "--duration", options->seconds,
           "simulated time of a run in s; half of it for arms of pieces and links");
  command->add_option("--rounds", options->rounds, "how often everything is measured")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->callback([options] {
    print_report(options->json, [&](auto progress) {
      return bench_plant(options->seconds, options->rounds, progress);
    });
  });
}

void add_control(CLI::App& group) {
  auto options = std::make_shared<Options>();
  options->seconds = 12.0;
  CLI::App* command =
      add(group, "control", "Tracking error against control rate and the terms of (17), their cost",
          *options, {shipped_config("paper_arm.yaml"), shipped_config("paper_simulation.yaml")});
  add_time(*command, "--seconds", options->seconds, "simulated time of every run, in s");
  add_time(*command, "--timing", options->timing_s, "time to measure costs for, a scene, in s");
  command->callback([options] {
    print_report(options->json, [&](auto progress) {
      std::vector<ControlScene> scenes;
      for (const std::string& config : options->configs)
        scenes.push_back(
            bench_scene(load_experiment(config), options->seconds, options->timing_s, progress));
      return scenes;
    });
  });
}

void add_stability(CLI::App& group) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      add(group, "stability", "Stability over K_P, dead time and valve lag: theory, simulation",
          *options, {shipped_config("paper_arm.yaml")});
  command->add_option("--points", options->points, "along every axis of the maps")
      ->check(CLI::Range(2, 100))
      ->capture_default_str();
  command->callback([options] {
    print_report(options->json, [&](auto progress) {
      std::vector<StabilityMap> maps;
      const Experiment experiment = load_experiment(options->configs.at(0));
      for (const StabilityAxis axis : {StabilityAxis::dead_time, StabilityAxis::valve_lag})
        maps.push_back(bench_stability(experiment, axis, options->points, progress));
      return maps;
    });
  });
}

void add_softness(CLI::App& group) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add(group, "softness", "Stiffness of the tip and tracking error, over K_P",
                          *options, {shipped_config("paper_arm_nominal.yaml")});
  command->callback([options] {
    print_report(options->json, [&](auto progress) {
      return bench_softness(load_experiment(options->configs.at(0)), progress);
    });
  });
}

void add_loop(CLI::App& group) {
  struct LoopOptions : LoopBenchOptions {
    bool json = false;
  };
  auto options = std::make_shared<LoopOptions>();
  options->config = shipped_config("paper_arm.yaml");
  CLI::App* command = add(
      group, "loop", "Round trip and wake-ups of softarmd beside a bare LCM echo and a bare sleep",
      options->json);
  command->add_option("CONFIG", options->config, "experiment in YAML: its arm is meant")
      ->capture_default_str();
  add_time(*command, "--seconds", options->seconds, "of each of the three scenes");
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
  command->callback([options] {
    load_experiment(options->config);  // errors name the file as the user did
    print_report(options->json, [&](auto progress) {
      return bench_loop(*options,
                        [&](const std::string& what) { progress("bench loop: " + what); });
    });
  });
}

}  // namespace

void add_bench_command(CLI::App& app) {
  CLI::App* group = app.add_subcommand("bench", "Measure how fast this machine is");
  group->require_subcommand(1);
  add_control(*group);
  add_stability(*group);
  add_softness(*group);
  add_bench_robustness_command(*group);
  add_plant(*group);
  add_bench_recordings_command(*group);
  add_loop(*group);
  add_bench_python_command(*group);
  add_bench_mocap_command(*group);
  add_model(*group);
}

}  // namespace softarm
