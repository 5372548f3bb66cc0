// softarm-dev bench robustness: arms that are not their model, under six control laws.
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "dev/bench/robustness_draws.hpp"
#include "dev/bench/robustness_scenes.hpp"
#include "dev/bench_report.hpp"
#include "dev/commands.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

struct RobustnessOptions {
  int seeds = 5;
  std::string scene, law;
  bool json = false, processes = false, stretching = false;
  int draws = 0;
  std::uint64_t seed = 1, first = 1;
  double from_s = -1.0;  ///< negative: as the scene has it
};

Experiment shipped(const std::string& name) { return load_experiment(shipped_config(name)); }

/// The worst of every figure.
void join(RobustnessTrial& worst, const RobustnessTrial& other) {
  for (const auto& [label, figure] : kRobustnessFigures)
    if (!(other.*figure <= worst.*figure)) worst.*figure = other.*figure;
  worst.stayed_active &= other.stayed_active;
}

void search(const RobustnessOptions& options) {
  const DrawLimits limits;
  Progress progress(true);
  const std::vector<Draw> draws =
      run_draws(limits, options.first, options.draws, options.seed, shipped, [&](int done) {
        if (progress.due()) progress.update(fmt::format("{} of {}", done, options.draws));
      });
  const std::string text = options.json ? draws_json(limits, draws) : draws_table(limits, draws);
  std::fwrite(text.data(), 1, text.size(), stdout);
}

/// The law of the rows over LCM, and of arms that stretch, if none is asked for.
bool is_asked(const RobustnessOptions& options, RobustnessLaw law) {
  if (!options.law.empty()) return options.law == name(law);
  return !(options.processes || options.stretching) || law == RobustnessLaw::observer_parameters;
}

void measure_robustness(const RobustnessOptions& options) {
  std::vector<RobustnessRow> rows;
  const std::vector<ObserverCost> costs =
      options.processes || options.stretching ? std::vector<ObserverCost>() : observer_costs();
  const auto trial = [&](const Experiment& experiment, const RobustnessScene& scene, int seed) {
    const auto number = static_cast<std::uint64_t>(seed);
    return options.processes ? run_processes(experiment, scene, number)
                             : run(experiment, scene, number);
  };
  {
    Progress progress(true);
    for (RobustnessScene& scene : robustness_scenes()) {
      if (options.from_s >= 0.0) scene.counted_from_s = options.from_s;
      if (scene.name.find(options.scene) == std::string::npos) continue;
      // Over a wire no frame comes at once.
      if (options.processes && scene.nominal) continue;
      RobustnessRow& row = rows.emplace_back(RobustnessRow{scene.name, scene.bound_mrad, {}});
      for (const RobustnessLaw law : kRobustnessLaws) {
        if (!is_asked(options, law)) continue;
        progress.update(scene.name + ": " + name(law));
        const Experiment experiment =
            robustness_experiment(scene, law, shipped, options.stretching);
        RobustnessTrial worst = trial(experiment, scene, 1);
        for (int seed = 2; seed <= options.seeds; ++seed)
          join(worst, trial(experiment, scene, seed));
        row.cells.push_back({law, worst});
      }
    }
  }
  if (rows.empty())
    throw CLI::ValidationError(
        "--scene", fmt::format("no scene has '{}' in its name{}", options.scene,
                               options.processes ? " and sensing that is not ideal" : ""));
  const std::string text = options.json ? json(rows, costs) : table(rows, costs);
  std::fwrite(text.data(), 1, text.size(), stdout);
}

}  // namespace

void add_bench_robustness_command(CLI::App& group) {
  auto options = std::make_shared<RobustnessOptions>();
  CLI::App* command = group.add_subcommand(
      "robustness", "Tracking errors on arms, valves and frames that are not as configured");
  command->add_flag("--json", options->json, "print JSON instead of tables");
  command->add_option("--seeds", options->seeds, "runs of every scene")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--scene", options->scene, "only scenes whose name contains this");
  std::vector<std::string> laws;
  for (const RobustnessLaw law : kRobustnessLaws) laws.emplace_back(name(law));
  command->add_option("--law", options->law, "only this one")->check(CLI::IsMember(laws));
  command
      ->add_option(
          "--from", options->from_s,
          "count the 20 s from so many seconds after ACTIVE on [default: 1; held still: 3]")
      ->check(number_between(0.0, 1e4));
  CLI::Option* processes = command->add_flag("--processes", options->processes,
                                             "with softarmd and softarm-plant over LCM, in real "
                                             "time: one run of every scene but for ideal "
                                             "sensing, some 25 s each, with the observer and its "
                                             "parameters unless --law asks for another");
  CLI::Option* stretching = command->add_flag(
      "--stretching", options->stretching,
      "the same arm with segments that stretch, as config/paper_arm_stretching.yaml: with the "
      "observer and its parameters unless --law asks for another");
  stretching->excludes(processes);
  command
      ->add_option("--draws", options->draws,
                   "instead: so many arms drawn at random, with the observer and its parameters")
      ->check(CLI::Range(1, 100'000))
      ->excludes(processes)
      ->excludes(stretching);
  command->add_option("--seed", options->seed, "of the arms drawn")->check(seed_number());
  command->add_option("--first", options->first, "number of the first of the arms drawn")
      ->check(CLI::Range(1, 1'000'000'000))
      ->capture_default_str();
  command->callback([options, command] {
    if (options->processes && command->count("--seeds") == 0) options->seeds = 1;
    options->draws > 0 ? search(*options) : measure_robustness(*options);
  });
}

}  // namespace softarm
