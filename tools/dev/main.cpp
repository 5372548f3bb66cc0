// softarm-dev: benchmarks, faults and long runs, for the development of softarm.
#include <iostream>

#include "apps/program.hpp"
#include "dev/commands.hpp"

int main(int argc, char** argv) {
  CLI::App app("Benchmarks, injected faults and long runs of softarm", "softarm-dev");
  app.require_subcommand(0, 1);
  softarm::add_bench_command(app);
  softarm::add_fault_command(app);
  softarm::add_soak_command(app);
  return softarm::run_program(argc, argv, app, [&app]() -> int {
    if (!app.get_subcommands().empty()) return softarm::kExitOk;
    std::cerr << app.help();
    return softarm::kExitUsage;
  });
}
