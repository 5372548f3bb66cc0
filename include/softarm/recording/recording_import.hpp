// Converts a table of recorded poses and pressures to a log of our messages.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "softarm/recording/recording_map.hpp"

namespace softarm {

/// Counts and extents of an import.
struct ImportSummary {
  std::int64_t rows = 0;
  std::int64_t frames = 0;       ///< distinct frames
  std::int64_t repeated = 0;     ///< rows with the poses of the row before: the same frame again
  std::int64_t missing = 0;      ///< frame numbers skipped: whole frame periods without a frame
  std::int64_t unseen = 0;       ///< frames in which a body was not seen
  std::int64_t rest_frames = 0;  ///< used in the rest window
  double rest_spread_m = 0.0;    ///< largest distance of a body at rest from its mean
  double duration_s = 0.0;
  double longest_gap_s = 0.0;  ///< between frames
};

/// Writes the log `out`: for every row a mocap_frame_t, preceded by a pressure_measurement_t and a
/// pressure_command_t where their columns are mapped. Commands are marked as shadow, because they
/// must not move a valve when the log is played back. The time of an event is the time of its row
/// in microseconds since the zero of the table; the capture time of a frame is that of its first
/// row.
/// @throws std::runtime_error for inconsistent data, or if the log cannot be written
ImportSummary import_recording(const MappedTable& recording, const std::filesystem::path& out);

/// Where the segment frames S_0 .. S_n sit on the bodies that carry them, as found in one recording
/// and used for others of the same arm, which then share its zero. An arm that was just used hangs
/// bent: a rest window in each recording would make each bend another zero.
struct MarkerFrames {
  std::vector<Eigen::Isometry3d> on_body;  ///< B_i^-1 S_i, the base first
  std::int64_t rest_frames = 0;            ///< they were found from
  double rest_spread_m = 0.0;              ///< largest distance of a body at rest from its mean
};

/// Those of the rest window of a recording.
/// @throws std::runtime_error for inconsistent data, or where the map has no rest window
MarkerFrames marker_frames(const MappedTable& recording);

/// As above, with these frames instead of those of the recording's rest window.
/// @throws std::runtime_error also where the number of bodies differs
ImportSummary import_recording(const MappedTable& recording, const MarkerFrames& frames,
                               const std::filesystem::path& out);

}  // namespace softarm
