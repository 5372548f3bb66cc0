// softarm check: is this configuration right, and what does it say in full?
#include <fmt/format.h>

#include <memory>
#include <string>

#include "softarm/commands.hpp"
#include "softarm/config/load.hpp"

namespace softarm {

void add_check_command(CLI::App& app) {
  auto* command = app.add_subcommand("check", "Check a configuration");
  auto file = std::make_shared<std::string>();
  command->add_option("CONFIG", *file, "the experiment, a YAML file")->required();
  command->callback([file] {
    const Experiment experiment = load_experiment(*file);
    fmt::print("# {}, configuration {}\n{}", *file, hash_text(experiment.hash),
               resolved_text(experiment));
  });
}

}  // namespace softarm
