// Reads a table of numbers from a text file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace softarm {

/// A table of numbers with named columns.
struct CsvTable {
  std::string file;
  std::vector<std::string> columns;  ///< from the first line
  std::vector<double> cells;         ///< row by row; NaN where a cell is empty or "nan"
  std::vector<int> lines;            ///< line number in the file, of every row

  /// Number of rows.
  std::size_t rows() const { return lines.size(); }
  /// One cell; `row` and `column` count from 0 and must be in range.
  double at(std::size_t row, std::size_t column) const {
    return cells[row * columns.size() + column];
  }
};

/// Reads `file`: a line of distinct column names, then lines with one number per column. Blank
/// lines, spaces around cells, a byte order mark and both line endings are accepted.
/// @throws std::runtime_error "file:line: ..." for anything else
CsvTable read_csv(const std::filesystem::path& file, char separator);

}  // namespace softarm
