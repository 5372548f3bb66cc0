// From a table of recorded poses and pressures to a log of our messages.
#pragma once

#include <cstdint>
#include <filesystem>

#include "softarm/recording/recording_map.hpp"

namespace softarm {

/// What an import found.
struct ImportSummary {
  std::int64_t rows = 0;
  std::int64_t frames = 0;  ///< with numbers of their own
  std::int64_t repeated =
      0;                     ///< rows whose poses are those of the row before: the same frame again
  std::int64_t missing = 0;  ///< numbers left out for whole frame periods without a frame
  std::int64_t unseen = 0;   ///< frames in which a body was not seen
  std::int64_t rest_frames = 0;
  double rest_spread_m = 0.0;  ///< largest distance of a body at rest from its mean
  double duration_s = 0.0;
  double longest_gap_s = 0.0;  ///< between frames
};

/// Writes `out`: for every row a mocap_frame_t, after a pressure_measurement_t and a
/// pressure_command_t where their columns are mapped (commands marked as shadow: played back, they
/// must move no valve). Events carry the row's time as microseconds since the table's zero; a
/// frame's capture time is the time of its first row.
/// @throws std::runtime_error for a table that makes no sense, or where the log cannot be written.
ImportSummary import_recording(const MappedTable& recording, const std::filesystem::path& out);

}  // namespace softarm
