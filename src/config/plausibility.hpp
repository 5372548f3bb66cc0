// What is allowed by the form of each key, but cannot be meant: mostly slips of units.
#pragma once

#include <string>
#include <vector>

#include "softarm/config/config_keys.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// Whether pressures go to a terminal that may be a real one: another back end than Modbus, or a
/// host that is not this machine. Torques go to no terminal.
bool drives_real_valves(const Experiment& experiment);

/// @throws ConfigError where harm would follow
void check_plausibility(const Experiment& experiment, const ConfigKeys& keys);

/// What is strange, but harms nobody; one sentence each.
std::vector<std::string> plausibility_warnings(const Experiment& experiment);

}  // namespace softarm
