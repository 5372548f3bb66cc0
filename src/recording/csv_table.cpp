#include "softarm/recording/csv_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string_view>

namespace softarm {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\"";
  const auto first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::vector<std::string_view> split(std::string_view line, char separator) {
  std::vector<std::string_view> cells;
  for (std::size_t start = 0;;) {
    const auto end = std::min(line.find(separator, start), line.size());
    cells.push_back(trimmed(line.substr(start, end - start)));
    if (end == line.size()) return cells;
    start = end + 1;
  }
}

std::optional<double> number(std::string_view cell) {
  if (cell.empty() || cell == "nan" || cell == "NaN" || cell == "NAN") {
    return std::numeric_limits<double>::quiet_NaN();
  }
  if (cell.starts_with('+')) cell.remove_prefix(1);
  double value = 0.0;
  const auto [end, code] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (code != std::errc() || end != cell.data() + cell.size()) return {};
  return value;
}

[[noreturn]] void fail(const std::string& file, int line, const std::string& what) {
  throw std::runtime_error(fmt::format("{}:{}: {}", file, line, what));
}

void read_header(CsvTable& table, int line, std::string_view text, char separator) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  for (const std::string_view name : split(text, separator)) {
    if (name.empty()) fail(table.file, line, "expected a name of every column, got an empty one");
    if (std::find(table.columns.begin(), table.columns.end(), name) != table.columns.end()) {
      fail(table.file, line, fmt::format("expected distinct column names, got {} twice", name));
    }
    table.columns.emplace_back(name);
  }
}

void read_row(CsvTable& table, int line, std::string_view text, char separator) {
  const auto cells = split(text, separator);
  if (cells.size() != table.columns.size()) {
    fail(table.file, line,
         fmt::format("expected {} cells, got {}", table.columns.size(), cells.size()));
  }
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto value = number(cells[i]);
    if (!value) {
      fail(table.file, line,
           fmt::format("{}: expected a number, got \"{}\"", table.columns[i], cells[i]));
    }
    table.cells.push_back(*value);
  }
  table.lines.push_back(line);
}

}  // namespace

CsvTable read_csv(const std::filesystem::path& file, char separator) {
  std::ifstream stream(file);
  if (!stream || std::filesystem::is_directory(file)) {
    throw std::runtime_error(fmt::format("{}: expected a file that can be read", file.string()));
  }
  CsvTable table;
  table.file = file.string();
  int line = 0;
  for (std::string text; std::getline(stream, text);) {
    ++line;
    if (trimmed(text).empty()) continue;
    if (table.columns.empty()) {
      read_header(table, line, text, separator);
    } else {
      read_row(table, line, text, separator);
    }
  }
  if (table.rows() == 0) fail(table.file, line, "expected a line of names and rows, got no row");
  return table;
}

}  // namespace softarm
