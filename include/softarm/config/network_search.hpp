// The network of a configuration that is wrong somewhere.
#pragma once

#include <filesystem>

#include "softarm/transport/settings.hpp"

namespace softarm {

/// What can be read of daemon.lcm (url, operator_channel, status_channel) in a file that
/// load_experiment refuses, or that is no YAML at all, and in what it includes; the rest by
/// default. For requests that vent the arm, which a mistake in a file must not stop. Reads line by
/// line; throws nothing for what it finds.
LcmSettings find_network(const std::filesystem::path& file);

}  // namespace softarm
