// The sub-commands of `softarm`. Each one adds itself to the command line and works in its
// callback.
#pragma once

#include <CLI/CLI.hpp>

namespace softarm {

/// softarm check CONFIG | --template
void add_check_command(CLI::App& app);

}  // namespace softarm
