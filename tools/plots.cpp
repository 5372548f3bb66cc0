#include "plots.hpp"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>

#include "program.hpp"

namespace softarm {
namespace {

/// The plotting script: beside an installed program, else in the source tree this was built from.
std::filesystem::path plot_script() {
  std::error_code error;
  const auto installed =
      std::filesystem::read_symlink("/proc/self/exe", error).parent_path().parent_path() / "share" /
      "softarm" / "plot_run.py";
  return std::filesystem::exists(installed, error) ? installed
                                                   : std::filesystem::path(SOFTARM_PLOT_SCRIPT);
}

}  // namespace

void draw_plots(const std::string& folder) {
  const std::string script = plot_script().string();
  char* const arguments[] = {const_cast<char*>("/usr/bin/python3"),
                             const_cast<char*>(script.c_str()), const_cast<char*>(folder.c_str()),
                             nullptr};
  pid_t child = 0;
  int status = 0;
  const bool drawn = posix_spawn(&child, arguments[0], nullptr, nullptr, arguments, environ) == 0 &&
                     waitpid(child, &status, 0) == child && status == 0;
  if (!drawn)
    print_error("softarm",
                "no plots: is python3-matplotlib installed? Use --no-plots to do without");
}

}  // namespace softarm
