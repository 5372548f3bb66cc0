// Checks of consistency between keys.
#pragma once

#include "softarm/config/experiment.hpp"
#include "softarm/config/keys.hpp"

namespace softarm {

/// @throws ConfigError at the key to change first.
void check_consistency(const Experiment& experiment, const Keys& reader);

}  // namespace softarm
