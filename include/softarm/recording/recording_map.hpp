// Meaning of the columns of a recorded table: the MAP of `softarm import`.
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "softarm/base/output_file.hpp"
#include "softarm/recording/csv_table.hpp"

namespace softarm {

/// The axis of the recording's world frame that points up. Ours is z.
enum class UpAxis { x, y, z };

/// What becomes of rows with the time of the row before.
enum class EqualTimes { refuse, first, last };

/// What becomes of a pressure that is no finite number.
enum class MissingPressure { refuse, hold };

/// Column indices of the pose of one rigid body.
struct BodyColumns {
  int id = 0;  ///< of the body in our messages
  std::array<std::size_t, 3> position{};
  std::array<std::size_t, 4> orientation{};  ///< x, y, z, w, whatever the order in the table
  double length_m = 0.0;  ///< of the segment whose end carries this body; 0 for the base
};

/// The time window in which the arm hangs still, in s, on the time axis of the table.
struct RestWindow {
  double from_s = 0.0;
  double to_s = 0.0;
};

/// Columns, units and channels of an import.
struct RecordingMap {
  std::size_t time_column = 0;
  double time_unit_s = 1.0;      ///< one unit of the table's time
  double position_unit_m = 1.0;  ///< one unit of the table's positions
  double pressure_unit_bar = 1.0;
  UpAxis up = UpAxis::z;
  std::vector<BodyColumns> bodies;  ///< the base, then the ends of the segments up to the tip
  /// Without a rest window the body frames are used as S_0 .. S_n.
  std::optional<RestWindow> rest;
  Eigen::Matrix3d base_rotation =
      Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();  ///< of S_0 at rest
  std::optional<double> frame_period_s;         ///< given: frames that never came count as missing
  std::vector<std::size_t> commanded;           ///< pressure columns, in chamber order
  std::vector<std::size_t> measured;            ///< the same of measured pressures
  EqualTimes equal_times = EqualTimes::refuse;  ///< else the first or the last of them counts
  /// refuse, or hold the value of the row before
  MissingPressure missing_pressure = MissingPressure::refuse;
  std::string mocap_channel;
  std::string command_channel;
  std::string measurement_channel;
};

/// A table with the map of its columns; read together, because the map gives the separator.
struct MappedTable {
  Files files;  ///< both, and what the map includes
  RecordingMap map;
  CsvTable table;
};

/// Reads a map and the table that it describes.
/// @throws ConfigError for a map that is wrong or names a column that the table does not have;
/// std::runtime_error for the table
MappedTable read_mapped_table(const std::filesystem::path& table, const std::filesystem::path& map);

}  // namespace softarm
