// softarm commission: from an unpacked arm to a tracked trajectory, one step after the other.
#include <fmt/format.h>
#include <unistd.h>

#include <iostream>
#include <map>
#include <memory>
#include <string>

#include "apps/program.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/commands.hpp"
#include "apps/softarm/commission_steps.hpp"
#include "softarm/base/output_file.hpp"
#include "softarm/client/arm_client.hpp"
#include "softarm/commissioning/first_day.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

constexpr double kPlant_s = 3.0;  ///< a simulated arm is heard within this time

struct CommissionOptions {
  CommissionSettings settings;
  bool yes = false;
};

/// Whether the arm is a simulated one, whose true state is on the network.
bool is_simulated(const Experiment& experiment) {
  ArmClient client(experiment);
  return client.wait_for([&] { return client.plant().has_value(); }, kPlant_s);
}

/// What a step would write over in a folder where nothing has been done yet: somebody else's.
std::filesystem::path foreign_file(const CommissionSettings& settings) {
  if (!Journal::is_in(settings.folder))
    for (const auto& file : {settings.calibrated(), settings.identified(), settings.motion("bend"),
                             settings.motion("track")})
      if (std::filesystem::exists(file)) return file;
  return {};
}

/// Asks before a step; without a terminal the answer is no.
bool agreed(const CommissionStep& step, bool yes) {
  if (yes) return true;
  fmt::print("{}Go on? [y/N] ", step.moves ? "THE ARM MOVES: a hand on the dump valve. " : "");
  std::cout.flush();
  std::string answer;
  return std::getline(std::cin, answer) && (answer == "y" || answer == "Y" || answer == "yes");
}

std::string report(const CommissionSettings& settings, const Journal& journal) {
  std::string text =
      fmt::format("# First day with {}\n\n| step | found |\n|---|---|\n", settings.config.string());
  for (const Journal::Entry& entry : journal.entries())
    text += fmt::format("| {} | {} |\n", entry.step, entry.found);
  const bool done = journal.entries().size() == commission_steps().size();
  text += done ? fmt::format(
                     "\nExperiments include {} from here on. Raise actuation.slew_bar_per_s, "
                     "bends and gains from there, one at a time.\n",
                     settings.identified().string())
               : fmt::format("\nNot finished: softarm commission {} --out {} goes on.\n",
                             settings.config.string(), settings.folder.string());
  return text;
}

int commission(const CommissionOptions& options) {
  const CommissionSettings& settings = options.settings;
  const Experiment experiment = load_experiment(settings.config);
  if (const auto file = foreign_file(settings); !file.empty())
    return fail(
        "softarm", kExitUsage,
        fmt::format("{} is not from softarm commission: another --out, please", file.string()));
  if (options.yes && !is_simulated(experiment))
    return fail("softarm", kExitUsage,
                fmt::format("--yes is for a simulated arm; none is heard on {}: a real one moves "
                            "only when somebody who sees it agrees",
                            experiment.transport.lcm.plant_channel));
  Journal journal(settings.folder);
  catch_stop_signals();
  ignore_broken_pipes();
  const auto& steps = commission_steps();
  int code = kExitOk;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const CommissionStep& step = steps[k];
    const std::uint64_t hash = load_experiment(step.begins_with(settings)).hash;
    fmt::print("\n== {} of {}: {} {}\n", k + 1, steps.size(), step.name, step.what);
    if (const auto* const done = journal.find(step.name, hash)) {
      fmt::print("done before: {}\n", done->found);
      continue;
    }
    if (!agreed(step, options.yes)) {
      fmt::print("stopped before this step; the same command goes on here\n");
      code = kExitFailure;
      break;
    }
    std::cout.flush();
    const StepOutcome outcome = step.run(settings);
    if (outcome.code != kExitOk) {
      print_error("softarm", fmt::format("{}: {}", step.name, outcome.next));
      code = outcome.code;
      break;
    }
    fmt::print("{}: {}\n", step.name, outcome.found);
    journal.note({step.name, hash, outcome.found});
  }
  const auto file = settings.folder / "report.md";
  write_text(file, report(settings, journal), experiment.files);
  fmt::print("\n{}\n{}", file.string(), report(settings, journal));
  return code;
}

}  // namespace

void add_commission_command(CLI::App& app) {
  auto options = std::make_shared<CommissionOptions>();
  CommissionSettings& settings = options->settings;
  settings.folder = "commissioning";
  CLI::App* command = app.add_subcommand(
      "commission",
      "The first day with an arm: check, calibrate, identify, first bend, first trajectory");
  command->add_option("CONFIG", settings.config, "experiment in YAML")->required();
  command
      ->add_option("--out", settings.folder,
                   "folder for what is found; a step that is done there is not repeated")
      ->capture_default_str();
  command->add_flag("--yes", options->yes, "do not ask: for a simulated arm only");
  command->add_option("--rest", settings.rest_s, "how long to look at the arm at rest, in s")
      ->check(positive_seconds())
      ->capture_default_str();
  command->add_option("--track", settings.track_s, "how long to follow (24), in s")
      ->check(positive_seconds())
      ->capture_default_str();
  const std::map<std::string, GainSharing> sharing = {{"arm", GainSharing::arm},
                                                      {"side", GainSharing::side},
                                                      {"segment", GainSharing::segment},
                                                      {"chamber", GainSharing::chamber}};
  command
      ->add_option("--gains", settings.gains,
                   "separate gains for each: (default) arm, side, segment or chamber")
      ->transform(one_word_of(sharing));
  run_where_given(*command, [options] { return commission(*options); });
}

}  // namespace softarm
