// The sub-commands of `softarm`. Each one adds itself to the command line and works in its
// callback.
#pragma once

#include <CLI/CLI.hpp>

namespace softarm {

void add_calibrate_command(CLI::App& app);
void add_check_command(CLI::App& app);
void add_commission_command(CLI::App& app);
void add_eval_command(CLI::App& app);
void add_identify_command(CLI::App& app);
void add_import_command(CLI::App& app);
void add_jog_command(CLI::App& app);
void add_law_command(CLI::App& app);
void add_replay_command(CLI::App& app);
void add_report_command(CLI::App& app);
void add_run_command(CLI::App& app);
void add_view_command(CLI::App& app);
void add_watch_command(CLI::App& app);
void add_operator_commands(CLI::App& app);

}  // namespace softarm
