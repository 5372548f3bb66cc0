#include "apps/python.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "apps/program.hpp"

namespace softarm {
namespace {

/// $SOFTARM_PYTHON, the environment that tools/python_environment makes, or Debian's.
std::string python() {
  if (const char* chosen = std::getenv("SOFTARM_PYTHON")) return chosen;
  const std::string environment = SOFTARM_PYTHON_ENVIRONMENT "/bin/python";
  return std::filesystem::exists(environment) ? environment : "/usr/bin/python3";
}

}  // namespace

int become_python(const std::string& program, std::vector<std::string> words) {
  std::error_code error;
  const auto built =
      std::filesystem::read_symlink("/proc/self/exe", error).parent_path().parent_path() / "python";
  if (std::filesystem::exists(built / "softarm", error)) ::setenv("PYTHONPATH", built.c_str(), 1);
  words.insert(words.begin(), python());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execv(pointers[0], pointers.data());
  return fail(program, kExitFailure,
              "cannot start " + words[0] + ": " + std::strerror(errno) +
                  "; tools/python_environment makes a Python for this");
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
