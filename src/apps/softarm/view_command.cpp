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

/// Replaces this program; returns only where that fails.
int view(const std::vector<std::string>& arguments) {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto built = program.parent_path().parent_path() / "python";
  if (std::filesystem::exists(built / "softarm", error)) ::setenv("PYTHONPATH", built.c_str(), 1);
  std::vector<std::string> words = {python(), "-m", "softarm.view"};
  words.insert(words.end(), arguments.begin(), arguments.end());
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
  CLI::App* command =
      app.add_subcommand("view", "The arm in a browser, live or from a recorded run");
  command->prefix_command();
  command->set_help_flag();
  command->callback([command] {
    if (const int code = view(command->remaining()); code != kExitOk) throw CLI::RuntimeError(code);
  });
}

}  // namespace softarm
