// softarm view: the arm in a browser. The page is made by the Python package; this finds it and a
// Python that has viser.
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/program.hpp"
#include "apps/softarm/commands.hpp"

namespace softarm {
namespace {

/// $SOFTARM_PYTHON, the environment that tools/python_environment makes, or Debian's.
std::string python() {
  if (const char* chosen = std::getenv("SOFTARM_PYTHON")) return chosen;
  const std::string environment = SOFTARM_PYTHON_ENVIRONMENT "/bin/python";
  return std::filesystem::exists(environment) ? environment : "/usr/bin/python3";
}

struct ViewOptions {
  std::string config;
  std::string log;
  std::string host = "127.0.0.1";
  int port = 8080;
  bool control = false;
};

/// Replaces this program; returns only where that fails.
int view(const ViewOptions& options) {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto built = program.parent_path().parent_path() / "python";
  if (std::filesystem::exists(built / "softarm", error)) ::setenv("PYTHONPATH", built.c_str(), 1);
  std::vector<std::string> words = {python(),
                                    "-m",
                                    "softarm.view",
                                    options.config,
                                    options.log,
                                    options.host,
                                    std::to_string(options.port),
                                    options.control ? "control" : ""};
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execv(pointers[0], pointers.data());
  print_error("softarm", "cannot start " + words[0] + ": " + std::strerror(errno) +
                             "; tools/python_environment makes a Python for this");
  return kExitFailure;
}

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
  command->add_flag("--control", options->control, "buttons to arm, disarm and stop a running arm")
      ->excludes(log);
  command->callback([options] {
    if (const int code = view(*options); code != kExitOk) throw CLI::RuntimeError(code);
  });
}

}  // namespace softarm
