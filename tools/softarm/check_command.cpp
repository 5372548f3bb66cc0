// softarm check: is this configuration right, and what does it say in full?
#include <fmt/format.h>

#include <memory>
#include <string>

#include "softarm/commands.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

struct CheckOptions {
  std::string file;
  bool print_template = false;
};

void check(const CheckOptions& options) {
  if (options.print_template) {
    fmt::print("{}", template_text());
    return;
  }
  const Experiment experiment = load_experiment(options.file);
  for (const std::string& warning : experiment_warnings(experiment)) {
    fmt::print(stderr, "{}: warning: {}\n", options.file, warning);
  }
  fmt::print("# {}, configuration {}\n{}", options.file, hash_text(experiment.hash),
             resolved_text(experiment));
}

}  // namespace

void add_check_command(CLI::App& app) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* command = app.add_subcommand(
      "check", "Check a configuration and print it in full, every default written out");
  auto* group = command->add_option_group("what to print")->require_option(1);
  group->add_option("CONFIG", options->file, "experiment in YAML");
  group->add_flag("--template", options->print_template,
                  "print a configuration that documents every key instead");
  command->callback([options] { check(*options); });
}

}  // namespace softarm
