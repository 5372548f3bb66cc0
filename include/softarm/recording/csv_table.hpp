// Reads a table of numbers from a text file, as laboratories export them.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace softarm {

/// The columns of a rigid body that a table names.
struct TableBody {
  std::string name;
  std::array<std::size_t, 3> position{};     ///< x, y, z
  std::array<std::size_t, 4> orientation{};  ///< x, y, z, w
};

/// A table of numbers with named columns.
struct CsvTable {
  std::string file;
  std::string format = "a table";    ///< what it was read as
  std::vector<std::string> columns;  ///< distinct names
  std::vector<double> cells;         ///< row by row; NaN where a cell is empty or "nan"
  std::vector<int> lines;            ///< line number in the file, of every row

  // What an export of a motion-capture program says of itself.
  std::vector<TableBody> bodies;
  std::optional<std::size_t> time_column;
  double position_unit_m = 0.0;  ///< 0: not said
  double frame_period_s = 0.0;   ///< 0: not said

  /// Number of rows.
  std::size_t rows() const { return lines.size(); }
  /// One cell; `row` and `column` count from 0 and must be in range.
  double at(std::size_t row, std::size_t column) const {
    return cells[row * columns.size() + column];
  }
};

/// Reads `file`: lines of column names, then lines with one number per column. Known are the CSV
/// export of OptiTrack Motive, those of Vicon (Tracker, Nexus), with commas or tabs, and the 6DOF
/// export of Qualisys, each with its header of several lines; any other table has one line of
/// distinct names. Blank lines, comments (# and %), quotes, spaces around cells, a byte order mark
/// and every kind of line end are accepted; decimal commas where the separator is another sign.
/// Rotation vectors and matrices become quaternions, columns NAME qx, qy, qz, qw.
/// @param separator  of the cells; empty: the one of , ; tab that the file has
/// @throws std::runtime_error "file:line: ..." for anything else
CsvTable read_csv(const std::filesystem::path& file, std::optional<char> separator = {});

}  // namespace softarm
