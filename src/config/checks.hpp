// What no single key can be wrong about: consistency between keys.
#pragma once

#include "softarm/config/experiment.hpp"
#include "softarm/config/keys.hpp"

namespace softarm {

/// @throws ConfigError at the key that is to be changed first.
void check_consistency(const Experiment& experiment, const Keys& reader);

}  // namespace softarm
