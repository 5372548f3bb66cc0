// softarm view: the arm in a browser. The page is made by the Python package.
#include <memory>
#include <string>

#include "apps/program.hpp"
#include "apps/python.hpp"
#include "apps/softarm/commands.hpp"

namespace softarm {
namespace {

struct ViewOptions {
  std::string config;
  std::string log;
  std::string host = "127.0.0.1";
  int port = 8080;
  bool control = false;
};

}  // namespace

void add_view_command(CLI::App& app) {
  auto options = std::make_shared<ViewOptions>();
  CLI::App* command =
      app.add_subcommand("view", "The arm in a browser, live or from a recorded run");
  command->add_option("CONFIG", options->config, "experiment in YAML")->required();
  CLI::Option* log = command->add_option(
      "--log", options->log,
      "play this run: its folder, its log.csv, or a log of softarm watch or lcm-logger");
  command->add_option("--host", options->host, "address to serve the page on")
      ->capture_default_str();
  command->add_option("--port", options->port, "port to serve it on, 0: any free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  command
      ->add_flag("--control", options->control,
                 "buttons to arm, disarm and stop a running arm; sliders for a "
                 "simulated one without a daemon")
      ->excludes(log);
  run_where_given(*command, [options] {
    return become_python("softarm",
                         {"-m", "softarm.view", options->config, options->log, options->host,
                          std::to_string(options->port), options->control ? "control" : ""});
  });
}

}  // namespace softarm
