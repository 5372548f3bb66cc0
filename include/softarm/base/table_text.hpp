// A text as lines of cells.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace softarm {

/// A line with its number in the file; its cells without quotes and spaces around them.
struct TextRow {
  int line = 0;
  std::vector<std::string> cells;

  bool blank() const;
  const std::string& cell(std::size_t index) const;
};

/// The lines that are neither blank nor comments.
struct TableText {
  std::string file;
  char separator = ',';
  std::vector<TextRow> rows;

  /// @throws std::runtime_error "file:line: what"
  [[noreturn]] void fail(int line, const std::string& what) const;
  /// A number; NaN for an empty cell and "nan". Decimal commas unless they separate.
  std::optional<double> number(std::string_view cell) const;
  /// Whether every cell is a number, and one is there.
  bool numeric(const TextRow& row) const;
};

/// @throws std::runtime_error where the file cannot be read
TableText read_table_text(const std::filesystem::path& file, std::optional<char> separator);

}  // namespace softarm
