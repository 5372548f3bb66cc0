// softarm check: checks a configuration and prints it in full. With --live: checks whether the
// running arm fits it.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <string>

#include "apps/program.hpp"
#include "apps/softarm/commands.hpp"
#include "apps/softarm/live_check.hpp"
#include "softarm/commissioning/loop_check.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

struct CheckOptions {
  std::string file;
  bool print_template = false;
  bool print_schema = false;
  bool loop = true;
  bool margins = false;
  bool live = false;
  LiveCheckOptions live_check;
};

/// The loop of an arm of more segments is simulated where that is asked for: it takes longer than a
/// check should.
constexpr int kMostSimulated = 6;

/// Margins of the loop, as a comment below the configuration.
void print_margins(const LoopMargins& margins) {
  if (margins.at.arm.empty()) return;
  fmt::print("# loop, on the arm {}, {}: ", margins.at.arm, margins.at.where);
  if (!(margins.at.growth_1ps < 0.0)) {
    fmt::print("unstable\n");
    return;
  }
  const std::string fades = std::isfinite(margins.at.growth_1ps)
                                ? fmt::format("fades at {:.2g} 1/s", -margins.at.growth_1ps)
                                : "leaves nothing after 4 s";
  fmt::print("a disturbance {}; gain margin {}{:.2f}, delay margin {}{:.1f} ms\n", fades,
             margins.gain >= kLargestGainMargin ? "above " : "", margins.gain,
             margins.delay_s >= kLargestDelayMargin_s ? "above " : "", 1e3 * margins.delay_s);
}

int check(const CheckOptions& options) {
  if (options.print_template || options.print_schema) {
    fmt::print("{}", options.print_template ? template_text() : schema_text());
    return kExitOk;
  }
  const Experiment experiment = load_experiment(options.file);
  for (const std::string& warning : experiment_warnings(experiment)) {
    say(fmt::format("{}: warning: {}\n", options.file, warning));
  }
  if (options.live) return check_live(experiment, options.live_check);
  LoopCheck loop;
  const bool external = experiment.control.law.get_if<ExternalLaw>() != nullptr;
  const bool simulated =
      !external && (options.margins || (options.loop && experiment.arm.size() <= kMostSimulated));
  if (simulated)
    loop = check_loop(experiment, options.margins ? LoopDepth::margins : LoopDepth::stability);
  for (const std::string& warning : loop_warnings(loop))
    say(fmt::format("{}: warning: {}\n", options.file, warning));
  fmt::print("# {}, configuration {}\n{}", options.file, hash_text(experiment.hash),
             resolved_text(experiment));
  for (const std::string& line : reaction_times(experiment)) fmt::print("# {}\n", line);
  if (external) fmt::print("# loop: not simulated; its law is in another process\n");
  if (!simulated && !external) fmt::print("# loop: not simulated; softarm check --margins does\n");
  print_margins(loop.configured);
  print_margins(loop.worst);
  return kExitOk;
}

void add_live_options(CLI::App& command, CheckOptions& options) {
  CLI::Option* live =
      command.add_flag("--live", options.live,
                       "look at the running arm instead: one line a check, exit code 1 where one "
                       "fails");
  LiveCheckOptions& more = options.live_check;
  command.add_option("--seconds", more.listen_s, "how long to listen, in s")
      ->check(positive_seconds())
      ->capture_default_str()
      ->needs(live);
  command.add_flag("--json", more.json, "the findings as JSON")->needs(live);
  CLI::Option* pulse =
      command
          .add_flag("--pulse", more.pulse,
                    "MOVES THE ARM: fill every chamber softly, one after the other, within the "
                    "limits of the section identification; softarmd must not run, Ctrl-C vents")
          ->needs(live);
  command
      .add_option("--pressure", more.plan.pressure_bar,
                  "of a pulse, in bar (default: what bends a segment alone by 0.15 rad)")
      ->check(number_between(0.001, 100.0))
      ->needs(pulse);
  command
      .add_option("--hold", more.plan.hold_s, "of a pulse, in s: two thirds settle, one measures")
      ->check(number_between(0.05, 100.0))
      ->capture_default_str()
      ->needs(pulse);
}

}  // namespace

void add_check_command(CLI::App& app) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* command = app.add_subcommand(
      "check",
      "Check a configuration and print it in full, every default written out; or a running arm");
  auto* group = command->add_option_group("what to print")->require_option(1);
  group->add_option("CONFIG", options->file, "experiment in YAML");
  group->add_flag("--template", options->print_template,
                  "print a configuration that documents every key instead");
  group->add_flag("--schema", options->print_schema,
                  "print a JSON Schema instead, by which editors complete and check an experiment");
  CLI::Option* margins = command->add_flag(
      "--margins", options->margins,
      "also how far the loop is from unstable: gain and delay margin, some seconds of simulation");
  command
      ->add_flag(
          "!--no-loop", options->loop,
          "do not simulate the loop (as for more than 6 segments), which takes about a second")
      ->excludes(margins);
  add_live_options(*command, *options);
  run_where_given(*command, [options] { return check(*options); });
}

}  // namespace softarm
