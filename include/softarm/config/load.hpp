// From a YAML file to a checked experiment, and back to text.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "softarm/config/config_error.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// Reads and checks an experiment. Every value of the result is finite, in range and consistent
/// with the others.
/// @throws ConfigError and nothing else.
Experiment load_experiment(const std::filesystem::path& file);

}  // namespace softarm
