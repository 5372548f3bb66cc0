// Entries as YAML: the resolved configuration, or the documented template.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <set>
#include <utility>

#include "config/printers.hpp"

namespace softarm {
namespace {

using Row = std::span<const double>;

/// As few numbers as have the same meaning: "0.5", "[1, 2]", "[[1, 0], [2, 0]]". fmt prints the
/// shortest text that reads back as the same number.
std::string numbers_text(const Form& form, Row numbers) {
  const auto uniform = [](Row row) {
    return std::all_of(row.begin(), row.end(), [&](double x) { return x == row.front(); });
  };
  if (form.sizes.empty() || (form.one_for_all && !numbers.empty() && uniform(numbers)))
    return fmt::format("{}", numbers.front());
  const std::size_t width = form.sizes.size() == 2 ? static_cast<std::size_t>(form.sizes[1]) : 1;
  std::vector<Row> rows;
  for (std::size_t i = 0; i < numbers.size(); i += width) rows.push_back(numbers.subspan(i, width));
  const bool short_rows =
      width == 1 || (form.one_for_all && std::all_of(rows.begin(), rows.end(), uniform));
  std::vector<std::string> texts;
  for (const Row row : rows)
    texts.push_back(short_rows ? fmt::format("{}", row.front())
                               : fmt::format("[{}]", fmt::join(row, ", ")));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

std::string as_yaml_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

class Writer {
 public:
  explicit Writer(bool documented) : documented_(documented) {}

  std::string take_text() { return std::move(out_); }

  void write(const std::vector<Entry>& entries, int depth) {
    for (const Entry& entry : entries) write(entry, depth);
  }

 private:
  void write(const Entry& entry, int depth) {
    const bool absent = entry.kind == Entry::Kind::numbers && entry.numbers.empty();
    const SectionKind kind = entry.key.kind;
    if (!documented_ && (absent || kind == SectionKind::input_only)) return;
    if (documented_) document(entry, depth);
    const auto outer_hint = hint_depth_;
    if (documented_ && (absent || kind != SectionKind::plain) && !hint_depth_) hint_depth_ = depth;
    write_value(entry, depth);
    hint_depth_ = outer_hint;
  }

  void write_value(const Entry& entry, int depth) {
    if (entry.kind == Entry::Kind::text) return line(entry.key, as_yaml_text(entry.text), depth);
    if (entry.kind == Entry::Kind::numbers) {
      const Form::Word* word = entry.form.find(entry.numbers);
      const std::string numbers =
          entry.numbers.empty() ? "0" : numbers_text(entry.form, entry.numbers);
      return line(entry.key, word ? word->text : numbers, depth);
    }
    line(entry.key, "", depth);
    if (entry.kind == Entry::Kind::section) return write(entry.entries, depth + 1);
    if (entry.kind == Entry::Kind::one_or_each && entry.entries.size() == 1)
      return write(entry.entries.front().entries, depth + 1);
    for (const Entry& item : entry.entries) {
      dash_ = true;
      write(item.entries, depth + 2);
    }
  }

  /// Indentation, and for a hint that is not in force the comment mark: "# " at the depth where the
  /// hint starts.
  std::string margin(int depth) const {
    if (!hint_depth_) return std::string(static_cast<std::size_t>(2 * depth), ' ');
    return fmt::format("{:{}}# {:{}}", "", 2 * *hint_depth_, "", 2 * (depth - *hint_depth_));
  }

  void line(const Key& key, const std::string& value, int depth) {
    out_ += fmt::format("{}{}{}:", margin(dash_ ? depth - 1 : depth), dash_ ? "- " : "", key.name);
    if (!value.empty()) out_ += " " + value;
    if (!documented_ && !value.empty() && !key.unit().empty())
      out_ += fmt::format("  # {}", key.unit());
    out_ += '\n';
    dash_ = false;
  }

  /// A wrapped comment, once for keys of one name, meaning and form.
  void document(const Entry& entry, int depth) {
    constexpr std::size_t kWidth = 100;
    const bool value = entry.kind == Entry::Kind::numbers || entry.kind == Entry::Kind::text;
    if (depth == 0 && !value) out_ += '\n';
    const std::string form = entry.form.text("", false);
    if (!explained_.insert(fmt::format("{}{}{}", entry.key.name, entry.key.doc, form)).second)
      return;
    const std::string text = entry.documentation(), indent = margin(depth);
    const std::size_t width = kWidth - indent.size() - 2;
    for (std::string_view rest = text; !rest.empty();) {
      std::size_t cut = rest.size() <= width ? rest.size() : rest.rfind(' ', width);
      if (cut == std::string_view::npos) cut = rest.size();
      out_ += fmt::format("{}# {}\n", indent, rest.substr(0, cut));
      rest.remove_prefix(std::min(rest.size(), cut + 1));
    }
  }

  std::string out_;
  bool documented_;
  std::optional<int> hint_depth_;    ///< where a hint starts that is not in force
  bool dash_ = false;                ///< the next line starts an item of a list
  std::set<std::string> explained_;  ///< names, meanings and forms
};

}  // namespace

std::string yaml_text(const Entry& root, bool documented) {
  Writer writer(documented);
  writer.write(root.entries, 0);
  return writer.take_text();
}

}  // namespace softarm
