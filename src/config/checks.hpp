// What keys must be together: consistent with each other, and not evidently a slip.
#pragma once

#include "softarm/config/config_keys.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// Whether pressures go to a terminal that may be a real one: another back end than Modbus, or a
/// host that is not this machine. Torques go to no terminal.
bool drives_real_valves(const Experiment& experiment);

/// Largest bend in rad that one chamber of the segment can hold at full pressure.
double full_bend_rad(const Experiment& experiment, std::size_t segment);

/// @throws ConfigError at the key that is to be changed first.
void check_consistency(const Experiment& experiment, const ConfigKeys& reader);

}  // namespace softarm
