// A first map of a recorded table, from what the table shows.
#pragma once

#include <string>

#include "softarm/recording/csv_table.hpp"

namespace softarm {

/// The text of a map (recording_map.hpp) with the reason of every value in a comment: bodies from
/// the header or from names and unit quaternions, units from magnitudes, the up axis from how the
/// arm hangs at rest, the order of quaternions from names or from how orientations follow
/// positions, the rate from the times, the base as the body that moves least.
/// @throws std::runtime_error where no two bodies or no time can be found
std::string propose_map(const CsvTable& table);

}  // namespace softarm
