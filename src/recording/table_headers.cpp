#include "recording/table_headers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <string_view>

namespace softarm {
namespace {

/// The value in the cell behind the one of this name; empty: there is none.
std::string value_of(const TextRow& row, std::string_view name) {
  for (std::size_t k = 0; k + 1 < row.cells.size(); ++k)
    if (row.cells[k] == name) return row.cells[k + 1];
  return {};
}

double unit_of(std::string_view name) {
  if (name == "Meters" || name == "m") return 1.0;
  if (name == "Centimeters" || name == "cm") return 0.01;
  if (name == "Millimeters" || name == "mm") return 0.001;
  return 0.0;
}

/// Names have to be distinct: a column that has none, or one that is taken, is called by its number.
void add_column(CsvTable& table, std::string name) {
  const bool taken = name.empty() || std::find(table.columns.begin(), table.columns.end(), name) !=
                                         table.columns.end();
  if (taken) name += fmt::format("{}#{}", name.empty() ? "" : " ", table.columns.size() + 1);
  table.columns.push_back(std::move(name));
}

/// Motive: a line of facts, then rows Type, Name, ID, (Parent), Rotation or Position, X Y Z W.
TableHeader read_motive(const TableText& text, CsvTable& table) {
  table.format = "the CSV export of Motive";
  const TextRow& facts = text.rows[0];
  table.position_unit_m = unit_of(value_of(facts, "Length Units"));
  const auto rate = text.number(value_of(facts, "Export Frame Rate"));
  if (rate && *rate > 0.0) table.frame_period_s = 1.0 / *rate;
  if (const std::string kind = value_of(facts, "Rotation Type");
      !kind.empty() && kind != "Quaternion")
    text.fail(facts.line,
              fmt::format("expected an export with Rotation Type Quaternion, got {}", kind));
  const TextRow *types = nullptr, *names = nullptr, *what = nullptr;
  std::size_t at = 1;
  for (; at < text.rows.size() && text.rows[at].cell(0) != "Frame"; ++at) {
    const TextRow& row = text.rows[at];
    if (row.cell(1) == "Type") types = &row;
    if (row.cell(1) == "Name") names = &row;
    const bool title = row.cell(0).empty() && row.cell(1).empty();
    if (title) what = &row;
  }
  if (at >= text.rows.size() || names == nullptr || what == nullptr)
    text.fail(facts.line,
              "expected Motive's rows Name, Rotation and Position, and one that begins with Frame");
  const TextRow& axes = text.rows[at];
  for (std::size_t k = 0; k < axes.cells.size(); ++k) {
    const std::string& title = what->cell(k);
    add_column(table, names->cell(k).empty() || k < 2
                          ? axes.cells[k]
                          : fmt::format("{} {} {}", names->cell(k), title, axes.cells[k]));
  }
  table.time_column = 1;
  TableHeader header;
  header.first_row = at + 1;
  for (std::size_t k = 2; k + 6 < axes.cells.size(); ++k) {
    const bool body = types == nullptr || types->cell(k) == "Rigid Body";
    if (!body || what->cell(k) != "Rotation" || (k > 2 && what->cell(k - 1) == "Rotation"))
      continue;
    if (what->cell(k + 4) == "Position") header.bodies.push_back({names->cell(k), k + 4, k});
  }
  return header;
}

/// Vicon: Objects or Segments, the rate, the names, Frame Sub-Frame RX RY RZ (RW) TX TY TZ, units.
TableHeader read_vicon(const TableText& text, CsvTable& table) {
  table.format = "an export of Vicon";
  if (text.rows.size() < 6) text.fail(text.rows[0].line, "expected Vicon's five header rows");
  const auto rate = text.number(text.rows[1].cell(0));
  if (!rate || !(*rate > 0.0)) text.fail(text.rows[1].line, "expected the frame rate");
  table.frame_period_s = 1.0 / *rate;
  const TextRow &names = text.rows[2], &axes = text.rows[3], &units = text.rows[4];
  if (axes.cell(0) != "Frame") text.fail(axes.line, "expected a row that begins with Frame");
  std::string name;
  TableHeader header;
  for (std::size_t k = 0; k < axes.cells.size(); ++k) {
    if (!names.cell(k).empty()) {
      name = names.cell(k);
      const auto colon = name.find(':');  // subject:segment
      if (colon != std::string::npos && name.substr(0, colon) == name.substr(colon + 1))
        name.resize(colon);
    }
    add_column(table,
               k < 2 || name.empty() ? axes.cells[k] : fmt::format("{} {}", name, axes.cells[k]));
    if (axes.cells[k] != "RX") continue;
    const bool quaternion = axes.cell(k + 3) == "RW";
    const std::size_t position = k + (quaternion ? 4 : 3);
    if (axes.cell(position) != "TX") continue;
    table.position_unit_m = unit_of(units.cell(position));
    header.bodies.push_back(
        {name, position, k,
         quaternion ? WrittenRotation::quaternion : WrittenRotation::rotation_vector,
         units.cell(k) == "deg" ? std::numbers::pi / 180.0 : 1.0});
  }
  header.first_row = 5;
  header.time_from_frame_s = table.frame_period_s;
  return header;
}

/// Qualisys: lines of a word and its value, then names as "BODY X", Y, Z, Roll, ..., Rot[0], ... Rot[8].
TableHeader read_qualisys(const TableText& text, CsvTable& table) {
  table.format = "the 6DOF export of Qualisys";
  table.position_unit_m = 0.001;
  TableHeader header;
  std::vector<std::string> names;
  std::size_t at = 0;
  for (; at < text.rows.size(); ++at) {
    const TextRow& row = text.rows[at];
    const std::string& word = row.cell(0);
    if (text.numeric(row)) break;
    if (word == "FREQUENCY")
      if (const auto rate = text.number(row.cell(1)); rate && *rate > 0.0)
        table.frame_period_s = 1.0 / *rate;
    if (word == "BODY_NAMES") names.assign(row.cells.begin() + 1, row.cells.end());
  }
  if (at == 0 || at >= text.rows.size())
    text.fail(text.rows.back().line, "expected rows of numbers");
  const TextRow& titles = text.rows[at - 1];
  if (std::none_of(titles.cells.begin(), titles.cells.end(),
                   [](const auto& c) { return c.ends_with("Rot[0]"); }))
    text.fail(titles.line,
              "expected a line of column names with Rot[0] to Rot[8]: export 6D data with a column "
              "header");
  std::string name;
  std::size_t position = 0;
  const std::size_t width = text.rows[at].cells.size();
  for (std::size_t k = 0; k < width; ++k) {
    const std::string& title = titles.cell(k);
    const bool begins = title == "X" || title.ends_with(" X");
    if (begins) {
      const std::size_t index = header.bodies.size();
      name = title.size() > 2       ? title.substr(0, title.size() - 2)
             : index < names.size() ? names[index]
                                    : fmt::format("body {}", index + 1);
      position = k;
    }
    add_column(table, begins                                    ? name + " X"
                      : name.empty() || title.starts_with(name) ? title
                                                                : name + " " + title);
    if (title.ends_with("Rot[0]"))
      header.bodies.push_back({name, position, k, WrittenRotation::matrix});
  }
  header.first_row = at;
  if (titles.cell(1) == "Time")
    table.time_column = 1;
  else if (table.frame_period_s > 0.0)
    header.time_from_frame_s = table.frame_period_s;
  return header;
}

TableHeader read_plain(const TableText& text, CsvTable& table) {
  const TextRow& names = text.rows[0];
  if (text.numeric(names)) {  // by number: #1, #2, ...
    for (std::size_t k = 0; k < names.cells.size(); ++k) add_column(table, "");
    TableHeader header;
    header.first_row = 0;
    return header;
  }
  for (const std::string& name : names.cells) {
    if (name.empty()) text.fail(names.line, "expected a name of every column, got an empty one");
    if (std::find(table.columns.begin(), table.columns.end(), name) != table.columns.end())
      text.fail(names.line, fmt::format("expected distinct column names, got {} twice", name));
    table.columns.push_back(name);
  }
  return {};
}

}  // namespace

TableHeader read_header(const TableText& text, CsvTable& table) {
  if (text.rows.empty()) text.fail(0, "expected a line of names and rows, got no row");
  const std::string& first = text.rows[0].cell(0);
  if (first == "Format Version") return read_motive(text, table);
  if (first == "Objects" || first == "Segments") return read_vicon(text, table);
  if (first == "NO_OF_FRAMES" || first == "FILE_VERSION") return read_qualisys(text, table);
  return read_plain(text, table);
}

}  // namespace softarm
