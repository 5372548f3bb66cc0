// Checks of consistency between keys.
#pragma once

#include "softarm/config/config_keys.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// @throws ConfigError at the key that is to be changed first.
void check_consistency(const Experiment& experiment, const ConfigKeys& reader);

}  // namespace softarm
