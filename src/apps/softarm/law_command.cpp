// softarm law: a control law in Python for a running softarmd. The Python package does it.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/program.hpp"
#include "apps/python.hpp"
#include "apps/softarm/commands.hpp"

namespace softarm {
namespace {

struct LawOptions {
  std::string law;
  std::string config;
  double duration_s = 0.0;
};

}  // namespace

void add_law_command(CLI::App& app) {
  auto options = std::make_shared<LawOptions>();
  CLI::App* command =
      app.add_subcommand("law", "Control a running arm by a law in Python (control.law: external)");
  command->add_option("LAW", options->law, "MODULE:CLASS or FILE.py:CLASS")
      ->required()
      ->check(law_name());
  command->add_option("CONFIG", options->config, "experiment in YAML")->required();
  command->add_option("--duration", options->duration_s, "s; left out: until it is ended")
      ->check(positive_seconds());
  run_where_given(*command, [options] {
    std::vector<std::string> words = {"-m", "softarm.law", options->law, options->config};
    if (options->duration_s > 0.0) {
      words.emplace_back("--duration");
      words.push_back(std::to_string(options->duration_s));
    }
    return become_python("softarm", std::move(words));
  });
}

}  // namespace softarm
