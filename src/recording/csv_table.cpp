#include "softarm/recording/csv_table.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "recording/table_headers.hpp"
#include "softarm/base/table_text.hpp"

namespace softarm {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Qualisys writes matrices column by column. The element of row 1 and column 3 is the sine of the
/// pitch in the third column before them: this shows whether a version did otherwise.
Eigen::Matrix3d matrix_of(const std::vector<double>& row, std::size_t first) {
  Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix3d>(row.data() + first);
  if (first < 3) return R;
  const double sine = std::sin(row[first - 3] * M_PI / 180.0);
  const bool by_rows = std::abs(R(2, 0) - sine) < 1e-3 && std::abs(R(0, 2) - sine) > 1e-3;
  if (by_rows) R.transposeInPlace();
  return R;
}

/// x, y, z, w; NaN where the body was not seen: a matrix of zeros.
Eigen::Vector4d quaternion_of(const WrittenBody& body, const std::vector<double>& row) {
  if (body.kind == WrittenRotation::rotation_vector) {
    const Eigen::Vector3d v =
        body.unit_rad * Eigen::Map<const Eigen::Vector3d>(row.data() + body.rotation);
    if (!v.allFinite()) return Eigen::Vector4d::Constant(kNone);
    const double half = 0.5 * v.norm();
    const double scale = half < 1e-8 ? 0.5 : 0.5 * std::sin(half) / half;
    Eigen::Vector4d q;
    q << scale * v, std::cos(half);
    return q;
  }
  const Eigen::Matrix3d R = matrix_of(row, body.rotation);
  if (!R.allFinite() || R.isZero(0.0)) return Eigen::Vector4d::Constant(kNone);
  return Eigen::Quaterniond(R).coeffs();
}

/// Columns behind those of the file: quaternions, and a time that counts frames.
void add_derived(CsvTable& table, const TableHeader& header) {
  for (const WrittenBody& body : header.bodies) {
    TableBody found{body.name, {body.position, body.position + 1, body.position + 2}, {}};
    for (std::size_t i = 0; i < 4; ++i) {
      if (body.kind == WrittenRotation::quaternion) {
        found.orientation[i] = body.rotation + i;
        continue;
      }
      found.orientation[i] = table.columns.size();
      table.columns.push_back(fmt::format("{} q{}", body.name, "xyzw"[i]));
    }
    table.bodies.push_back(found);
  }
  if (header.time_from_frame_s > 0.0) {
    table.time_column = table.columns.size();
    table.columns.emplace_back("time");
  }
}

std::vector<double> numbers_of(const TableText& text, const CsvTable& table, const TextRow& row,
                               std::size_t written) {
  // A separator at the end of a line, and cells that an export leaves out there.
  const bool longer = row.cells.size() == written + 1 && row.cells.back().empty();
  const bool shorter = !table.bodies.empty() && row.cells.size() < written;
  if (row.cells.size() != written && !longer && !shorter)
    text.fail(row.line, fmt::format("expected {} cells, got {}", written, row.cells.size()));
  std::vector<double> values;
  for (std::size_t k = 0; k < written; ++k) {
    const auto value = text.number(row.cell(k));
    if (!value)
      text.fail(row.line,
                fmt::format("{}: expected a number, got \"{}\"", table.columns[k], row.cell(k)));
    values.push_back(*value);
  }
  return values;
}

}  // namespace

CsvTable read_csv(const std::filesystem::path& file, std::optional<char> separator) {
  const TableText text = read_table_text(file, separator);
  CsvTable table;
  table.file = text.file;
  const TableHeader header = read_header(text, table);
  const std::size_t written = table.columns.size();
  for (const WrittenBody& body : header.bodies) {
    const std::size_t last = body.rotation + (body.kind == WrittenRotation::matrix       ? 9
                                              : body.kind == WrittenRotation::quaternion ? 4
                                                                                         : 3);
    if (last > written || body.position + 3 > written)
      text.fail(text.rows[0].line, fmt::format("expected all columns of {}", body.name));
  }
  if (table.time_column && *table.time_column >= written)
    text.fail(text.rows[header.first_row - 1].line,
              fmt::format("expected times in column {}, got {} columns", *table.time_column + 1,
                          written));
  add_derived(table, header);
  double first_frame = kNone;
  for (std::size_t k = header.first_row; k < text.rows.size(); ++k) {
    std::vector<double> values = numbers_of(text, table, text.rows[k], written);
    for (const WrittenBody& body : header.bodies) {
      if (body.kind == WrittenRotation::quaternion) continue;
      const Eigen::Vector4d q = quaternion_of(body, values);
      values.insert(values.end(), q.begin(), q.end());
    }
    if (header.time_from_frame_s > 0.0) {
      if (std::isnan(first_frame)) first_frame = values[0];
      values.push_back((values[0] - first_frame) * header.time_from_frame_s);
    }
    table.cells.insert(table.cells.end(), values.begin(), values.end());
    table.lines.push_back(text.rows[k].line);
  }
  if (table.rows() == 0)
    text.fail(text.rows.back().line, "expected a line of names and rows, got no row");
  return table;
}

}  // namespace softarm
