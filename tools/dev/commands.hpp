// The sub-commands of `softarm-dev`. Each one adds itself to the command line and works in its
// callback.
#pragma once

#include <CLI/CLI.hpp>

namespace softarm {

void add_bench_command(CLI::App& app);
void add_bench_robustness_command(CLI::App& group);
void add_bench_recordings_command(CLI::App& group);
void add_bench_python_command(CLI::App& group);
void add_bench_mocap_command(CLI::App& group);
void add_fault_command(CLI::App& app);
void add_soak_command(CLI::App& app);

}  // namespace softarm
