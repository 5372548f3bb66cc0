// A table of numbers out of a text file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace softarm {

struct CsvTable {
  std::string file;
  std::vector<std::string> columns;  ///< from the first line
  std::vector<double> cells;         ///< row by row; NaN where a cell is empty or says nan
  std::vector<int> lines;            ///< in the file, of every row

  std::size_t rows() const { return lines.size(); }
  double at(std::size_t row, std::size_t column) const {
    return cells[row * columns.size() + column];
  }
};

/// Reads `file`: a line of distinct column names, then lines of as many numbers. Blank lines,
/// spaces around cells, a byte order mark and either line ending are accepted. @throws
/// std::runtime_error "file:line: ..." for anything else.
CsvTable read_csv(const std::filesystem::path& file, char separator);

}  // namespace softarm
