#include "softarm/base/table_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>

namespace softarm {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const auto first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

/// Cells in quotes may hold the separator, and two quotes stand for one.
std::vector<std::string> split(std::string_view line, char separator) {
  std::vector<std::string> cells;
  std::string cell;
  bool quoted = false, was_quoted = false;
  const auto take = [&] {
    cells.emplace_back(was_quoted ? cell : std::string(trimmed(cell)));
    cell.clear();
    was_quoted = false;
  };
  for (std::size_t at = 0; at < line.size(); ++at) {
    const char c = line[at];
    if (c == '"' && quoted && at + 1 < line.size() && line[at + 1] == '"') {
      cell += c;
      ++at;
    } else if (c == '"' && (quoted || trimmed(cell).empty())) {
      if (!quoted) cell.clear();
      quoted = !quoted;
      was_quoted = true;
    } else if (c == separator && !quoted) {
      take();
    } else if (!(was_quoted && !quoted)) {
      cell += c;
    }
  }
  take();
  return cells;
}

std::vector<std::string_view> lines_of(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    lines.push_back(text.substr(0, end));
    const bool pair = text.substr(end, 2) == "\r\n";
    text.remove_prefix(std::min(text.size(), end + (pair ? 2 : 1)));
  }
  return lines;
}

/// The sign that separates most of the lines into as many cells.
char separator_of(const std::vector<std::string_view>& lines) {
  constexpr std::size_t kLooked = 40;
  char best = ',';
  std::size_t most = 0;
  for (const char candidate : {';', '\t', ','}) {
    std::vector<std::size_t> counts;
    for (std::size_t k = lines.size() > kLooked ? lines.size() - kLooked : 0; k < lines.size(); ++k)
      if (!trimmed(lines[k]).empty()) counts.push_back(split(lines[k], candidate).size());
    if (counts.empty()) continue;
    std::nth_element(counts.begin(),
                     counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2), counts.end());
    const std::size_t typical = counts[counts.size() / 2];
    // A decimal comma splits cells too: the other signs come first.
    if (typical > std::max<std::size_t>(1, candidate == ',' ? most : 0) &&
        (most < 2 || candidate != ',')) {
      if (typical > most) best = candidate;
      most = std::max(most, typical);
    }
  }
  return best;
}

}  // namespace

bool TextRow::blank() const {
  return std::all_of(cells.begin(), cells.end(), [](const auto& cell) { return cell.empty(); });
}

const std::string& TextRow::cell(std::size_t index) const {
  static const std::string kNone;
  return index < cells.size() ? cells[index] : kNone;
}

void TableText::fail(int line, const std::string& what) const {
  throw std::runtime_error(fmt::format("{}:{}: {}", file, line, what));
}

std::optional<double> TableText::number(std::string_view cell) const {
  if (cell.empty() || cell == "nan" || cell == "NaN" || cell == "NAN")
    return std::numeric_limits<double>::quiet_NaN();
  std::string text(cell.substr(cell.starts_with('+') ? 1 : 0));
  if (separator != ',') std::replace(text.begin(), text.end(), ',', '.');
  double value = 0.0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

bool TableText::numeric(const TextRow& row) const {
  return !row.blank() && std::all_of(row.cells.begin(), row.cells.end(),
                                     [this](const auto& cell) { return number(cell).has_value(); });
}

TableText read_table_text(const std::filesystem::path& file, std::optional<char> separator) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file))
    throw std::runtime_error(fmt::format("{}: expected a file that can be read", file.string()));
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  std::string_view rest = text;
  if (rest.starts_with("\xef\xbb\xbf")) rest.remove_prefix(3);
  const auto lines = lines_of(rest);
  TableText table;
  table.file = file.string();
  table.separator = separator.value_or(separator_of(lines));
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const std::string_view line = trimmed(lines[k]);
    if (line.empty() || line[0] == '#' || line[0] == '%') continue;
    table.rows.push_back({static_cast<int>(k) + 1, split(lines[k], table.separator)});
  }
  return table;
}

}  // namespace softarm
