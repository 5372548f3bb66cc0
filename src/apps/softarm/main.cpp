// softarm: the tools around the daemon, one sub-command each.
#include <iostream>

#include "apps/program.hpp"
#include "apps/softarm/commands.hpp"

int main(int argc, char** argv) {
  CLI::App app("Tools for soft continuum arms under closed-loop control", "softarm");
  app.require_subcommand(0, 1);
  softarm::add_calibrate_command(app);
  softarm::add_check_command(app);
  softarm::add_commission_command(app);
  softarm::add_eval_command(app);
  softarm::add_identify_command(app);
  softarm::add_import_command(app);
  softarm::add_jog_command(app);
  softarm::add_law_command(app);
  softarm::add_replay_command(app);
  softarm::add_report_command(app);
  softarm::add_run_command(app);
  softarm::add_view_command(app);
  softarm::add_watch_command(app);
  softarm::add_operator_commands(app);
  return softarm::run_program(argc, argv, app, [&app]() -> int {
    if (!app.get_subcommands().empty()) return softarm::kExitOk;
    std::cerr << app.help();
    return softarm::kExitUsage;
  });
}
