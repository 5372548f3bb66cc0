// softarm-soak: a daemon and a simulated arm under random faults for as long as wanted.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>

#include "program.hpp"
#include "signals.hpp"
#include "soak/soak_run.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

int soak(SoakOptions options, const std::string& out, bool as_json) {
  load_experiment(options.config);  // a wrong one is told by the name the user gave
  const bool own_folder = out.empty();
  options.folder =
      own_folder ? std::filesystem::temp_directory_path() / fmt::format("softarm_soak_{}", getpid())
                 : std::filesystem::path(out);
  std::filesystem::create_directories(options.folder);
  catch_stop_signals();
  ignore_broken_pipes();
  say(fmt::format(
      "softarm-soak: {:g} s, seed {}; configuration and output of the processes in {}\n",
      options.duration_s, options.seed, options.folder.string()));
  const SoakCounters counters = SoakRun(options).run();
  fmt::print("{}", as_json ? report_json(counters) : report_text(counters));
  if (!failures(counters).empty()) return kExitFailure;
  if (own_folder) std::filesystem::remove_all(options.folder);
  return kExitOk;
}

}  // namespace
}  // namespace softarm

int main(int argc, char** argv) {
  CLI::App app(
      "Runs softarmd and softarm-plant at 500 Hz with random references through theta = 0, causes "
      "one random fault after the other, and counts what was answered and recovered. Exit code 1: "
      "a fault was not, a process ended, or memory or file descriptors grew after the warm-up",
      "softarm-soak");
  softarm::SoakOptions options;
  std::string out;
  bool as_json = false;
  app.add_option("CONFIG", options.config, "experiment in YAML: its arm and controller are meant")
      ->required();
  app.add_option("--duration", options.duration_s, "of the run")
      ->check(softarm::positive_seconds())
      ->capture_default_str();
  app.add_option("--between", options.between_s, "mean of the random time between two faults")
      ->check(softarm::positive_seconds())
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of faults and references")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--out", out,
                 "folder for what the processes print; left out: a temporary one, kept after a "
                 "failure");
  app.add_flag("--json", as_json, "print the counters as JSON");
  return softarm::run_program(argc, argv, app,
                              [&] { return softarm::soak(options, out, as_json); });
}
