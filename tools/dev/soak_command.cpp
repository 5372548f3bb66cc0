// softarm-dev soak: a daemon and a simulated arm under random faults for as long as wanted.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "apps/program.hpp"
#include "apps/signals.hpp"
#include "dev/commands.hpp"
#include "dev/soak/soak_run.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

int soak(SoakOptions options, const std::string& out, bool as_json) {
  load_experiment(options.config);  // errors name the file as the user did
  const bool own_folder = out.empty();
  options.folder =
      own_folder ? std::filesystem::temp_directory_path() / fmt::format("softarm_soak_{}", getpid())
                 : std::filesystem::path(out);
  std::filesystem::create_directories(options.folder);
  catch_stop_signals();
  ignore_broken_pipes();
  say(fmt::format(
      "softarm-dev soak: {:g} s, seed {}; configuration and output of the processes in {}\n",
      options.duration_s, options.seed, options.folder.string()));
  const SoakCounters counters = SoakRun(options).run();
  fmt::print("{}", as_json ? report_json(counters) : report_text(counters));
  if (!failures(counters).empty()) return kExitFailure;
  if (own_folder) std::filesystem::remove_all(options.folder);
  return kExitOk;
}

}  // namespace

void add_soak_command(CLI::App& app) {
  struct Arguments {
    SoakOptions soak;
    std::string out;
    bool as_json = false;
  };
  auto options = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "soak",
      "Runs softarmd and softarm-plant at 500 Hz with random references through theta = 0, causes "
      "one random fault after the other, and counts what was answered and recovered. Exit code 1: "
      "a fault was not, a process ended, or memory or file descriptors grew after the warm-up");
  command
      ->add_option("CONFIG", options->soak.config,
                   "experiment in YAML, for its arm and its controller")
      ->required();
  command->add_option("--duration", options->soak.duration_s, "of the run")
      ->check(positive_seconds())
      ->capture_default_str();
  command
      ->add_option("--between", options->soak.between_s,
                   "mean of the random time between two faults")
      ->check(positive_seconds())
      ->capture_default_str();
  command->add_option("--seed", options->soak.seed, "of faults and references")
      ->check(seed_number())
      ->capture_default_str();
  command->add_option(
      "--out", options->out,
      "folder for what the processes print; left out: a temporary one, kept after a "
      "failure");
  command->add_flag("--json", options->as_json, "print the counters as JSON");
  run_where_given(*command,
                  [options] { return soak(options->soak, options->out, options->as_json); });
}

}  // namespace softarm
