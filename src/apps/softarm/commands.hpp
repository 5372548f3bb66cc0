// The sub-commands of `softarm`. Each one adds itself to the command line and works in its
// callback.
#pragma once

#include <CLI/CLI.hpp>

namespace softarm {

/// softarm calibrate CONFIG [--duration S] [-o FILE] [--base plate|arm]
void add_calibrate_command(CLI::App& app);

/// softarm check CONFIG [--live [--pulse]] | --template
void add_check_command(CLI::App& app);

/// softarm commission CONFIG [--out DIR] [--yes]
void add_commission_command(CLI::App& app);

/// softarm eval FILE [--mass point|distributed] [--method direct|augmented]
void add_eval_command(CLI::App& app);

/// softarm identify CONFIG [--live | --log LOG] [--output FILE] [--seeds N]
void add_identify_command(CLI::App& app);

/// softarm import CSV [MAP.yaml --out LOG]
void add_import_command(CLI::App& app);

/// softarm jog CONFIG SEGMENT CHAMBER PRESSURE
void add_jog_command(CLI::App& app);

/// softarm law FILE.py:CLASS CONFIG [--duration S]
void add_law_command(CLI::App& app);

/// softarm replay LOG CONFIG [--any-configuration] [--json]
void add_replay_command(CLI::App& app);

/// softarm report LOG CONFIG [--out DIR]
void add_report_command(CLI::App& app);

/// softarm run CONFIG [--out DIR] [--duration S] [--seed N] [--law MODULE:CLASS]
void add_run_command(CLI::App& app);

/// softarm view CONFIG [--log LOG] [--port PORT] [--control]
void add_view_command(CLI::App& app);

/// softarm watch CONFIG [--out DIR] [--duration S]
void add_watch_command(CLI::App& app);

/// softarm arm CONFIG, softarm disarm CONFIG, softarm estop CONFIG, softarm deadman CONFIG
void add_operator_commands(CLI::App& app);

}  // namespace softarm
