#include "apps/softarm/plots.hpp"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "apps/program.hpp"

namespace softarm {

void draw_plots(const std::string& folder) {
  const std::string script = shared_file("plot_run.py", SOFTARM_PLOT_SCRIPT);
  char* const arguments[] = {const_cast<char*>("/usr/bin/python3"),
                             const_cast<char*>(script.c_str()), const_cast<char*>(folder.c_str()),
                             nullptr};
  pid_t child = 0;
  int status = 0;
  const bool drawn = posix_spawn(&child, arguments[0], nullptr, nullptr, arguments, environ) == 0 &&
                     waitpid(child, &status, 0) == child && status == 0;
  if (!drawn)
    print_error(
        "softarm",
        "no plots, for the reason above (is python3-matplotlib installed?); --no-plots does "
        "without");
}

}  // namespace softarm
