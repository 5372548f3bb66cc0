// The sub-commands of `softarm-dev`. Each one adds itself to the command line and works in its
// callback.
#pragma once

#include <CLI/CLI.hpp>

namespace softarm {

/// softarm-dev bench model [--json] [--seconds S] [--golden FILE]
void add_bench_command(CLI::App& app);

/// softarm-dev bench control [--json] [CONFIG...], stability, softness: added to `softarm-dev
/// bench`
void add_bench_control_commands(CLI::App& group);

/// softarm-dev bench robustness [--json] [--seeds N] [--scene TEXT] [--law NAME]: added to
/// `softarm-dev bench`
void add_bench_robustness_command(CLI::App& group);

/// softarm-dev bench recordings DATA [--json] [--only TEXT]: added to `softarm-dev bench`
void add_bench_recordings_command(CLI::App& group);

/// softarm-dev bench plant [--json] [--duration S] [--rounds N]: added to `softarm-dev bench`
void add_bench_plant_command(CLI::App& group);

/// softarm-dev bench loop [--json] [--seconds S] [--rate HZ] [--busy N] [--cpu N] [CONFIG]: added
/// to `softarm-dev bench`
void add_bench_loop_command(CLI::App& group);

/// softarm-dev bench python [--json] [--seconds S] [--soromox PYTHON] [CONFIG]: added to
/// `softarm-dev bench`
void add_bench_python_command(CLI::App& group);
/// softarm-dev bench mocap [--frames N] [--port PORT]: added to `softarm-dev bench`
void add_bench_mocap_command(CLI::App& group);

/// softarm-dev fault CONFIG FAULT | --list
void add_fault_command(CLI::App& app);

/// softarm-dev soak CONFIG [--duration S] [--seed N]
void add_soak_command(CLI::App& app);

}  // namespace softarm
