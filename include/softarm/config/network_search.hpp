// The LCM settings of a configuration that cannot be loaded.
#pragma once

#include <filesystem>

#include "softarm/transport/settings.hpp"

namespace softarm {

/// The settings of daemon.lcm (url, operator_channel, status_channel) that can be found in a file
/// that load_experiment refuses, even invalid YAML, and in the files it includes; defaults for the
/// others. For requests that vent the arm: an error in a file must not prevent them. Reads line by
/// line; no content of a file makes it throw.
LcmSettings find_network(const std::filesystem::path& file);

}  // namespace softarm
