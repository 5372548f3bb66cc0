#include "apps/softarm/python_module.hpp"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>

namespace softarm {
namespace {

/// $SOFTARM_PYTHON, the environment that tools/python_environment makes, or Debian's.
std::string python() {
  if (const char* chosen = std::getenv("SOFTARM_PYTHON")) return chosen;
  const std::string environment = SOFTARM_PYTHON_ENVIRONMENT "/bin/python";
  return std::filesystem::exists(environment) ? environment : "/usr/bin/python3";
}

}  // namespace

std::string run_python_module(const std::string& module, const std::vector<std::string>& words) {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto built = program.parent_path().parent_path() / "python";
  if (std::filesystem::exists(built / "softarm", error)) ::setenv("PYTHONPATH", built.c_str(), 1);
  std::vector<std::string> all = {python(), "-m", module};
  all.insert(all.end(), words.begin(), words.end());
  std::vector<char*> pointers;
  for (std::string& word : all) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execv(pointers[0], pointers.data());
  return all[0];
}

CLI::Validator law_name() {
  const auto check = [](std::string& text) -> std::string {
    const std::size_t colon = text.rfind(':');
    return colon != std::string::npos && colon > 0 && colon + 1 < text.size()
               ? std::string()
               : "expected MODULE:CLASS or FILE.py:CLASS, got " + text;
  };
  return {check, "MODULE:CLASS"};
}

}  // namespace softarm
