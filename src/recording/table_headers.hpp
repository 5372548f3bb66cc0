// Headers of several lines: the exports of motion-capture programs.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "softarm/base/table_text.hpp"
#include "softarm/recording/csv_table.hpp"

namespace softarm {

/// How a body's rotation is written.
enum class WrittenRotation { quaternion, rotation_vector, matrix };

/// A body whose columns are to be found in the rows.
struct WrittenBody {
  std::string name;
  std::size_t position = 0;  ///< first of three columns
  std::size_t rotation = 0;  ///< first of its columns
  WrittenRotation kind = WrittenRotation::quaternion;
  double unit_rad = 1.0;  ///< of a rotation vector
};

/// What a header says; `first_row` is the first row of numbers.
struct TableHeader {
  std::size_t first_row = 1;
  std::vector<WrittenBody> bodies;
  double time_from_frame_s = 0.0;  ///< above zero: the first column counts frames of this period
};

/// Reads a header, fills in format, names of columns, units and rates.
/// @throws std::runtime_error where it is none
TableHeader read_header(const TableText& text, CsvTable& table);

}  // namespace softarm
