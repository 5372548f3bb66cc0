// What no single key can be wrong about: consistency between keys.
#pragma once

#include <string>
#include <vector>

#include "config/reader.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// @throws ConfigError at the key that is to be changed first.
void check_consistency(const Experiment& experiment, const ExperimentReader& reader);

}  // namespace softarm
