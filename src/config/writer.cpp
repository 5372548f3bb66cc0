#include "config/writer.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

namespace softarm {
namespace {

constexpr std::size_t kDocWidth = 100;

/// The shortest text that reads back as the same number.
std::string number_text(double value) { return fmt::format("{}", value); }

std::string list_text(std::span<const double> values) {
  std::vector<std::string> texts;
  for (const double value : values) texts.push_back(number_text(value));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

bool all_equal(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [&](double v) { return v == values.front(); });
}

std::string pairs_text(const std::vector<double>& values) {
  std::vector<std::string> texts;
  bool scalars = true;
  for (std::size_t i = 0; i + 1 < values.size(); i += 2) {
    scalars = scalars && values[i] == values[i + 1];
  }
  for (std::size_t i = 0; i + 1 < values.size(); i += 2) {
    texts.push_back(scalars ? number_text(values[i]) : list_text(std::span(values).subspan(i, 2)));
  }
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

std::string shape_doc(const Shape& shape) {
  switch (shape.kind) {
    case Shape::Kind::scalar_or_list:
      return "number or list";
    case Shape::Kind::scalar_or_pairs:
      return "number, list or list of pairs";
    default:
      return shape.count == 0 ? "list" : fmt::format("list of {}", shape.count);
  }
}

std::string in_quotes(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

}  // namespace

/// Indentation, and what makes a hint of a line that is not in force: "# " at the depth where the
/// hint starts.
std::string ExperimentWriter::margin(int depth) const {
  if (!hint_depth_) return std::string(static_cast<std::size_t>(2 * depth), ' ');
  return fmt::format("{:{}}# {:{}}", "", 2 * *hint_depth_, "", 2 * (depth - *hint_depth_));
}

void ExperimentWriter::line(const std::string& content) {
  out_ += fmt::format("{}{}{}\n", margin(dash_ ? depth_ - 1 : depth_), dash_ ? "- " : "", content);
  dash_ = false;
}

/// A comment of its own, wrapped.
void ExperimentWriter::comment(const std::string& content) {
  const std::string indent = margin(depth_);
  const std::size_t width = kDocWidth - indent.size() - 2;
  std::string_view rest = content;
  while (!rest.empty()) {
    std::size_t cut = rest.size() <= width ? rest.size() : rest.rfind(' ', width);
    if (cut == std::string_view::npos) cut = rest.size();
    out_ += fmt::format("{}# {}\n", indent, rest.substr(0, cut));
    rest.remove_prefix(std::min(rest.size(), cut + 1));
  }
}

void ExperimentWriter::document(const Field& field, const std::string& what) {
  if (!documented_ || brief_) return;
  if (lists_ > 0 && !told_.insert(fmt::format("{}: {}", field.key, field.doc)).second) return;
  std::string facts = what;
  const auto add = [&facts](const std::string& separator, const std::string& fact) {
    if (!fact.empty()) facts.append(facts.empty() ? "" : separator).append(fact);
  };
  if (what != "text") add(" ", field.range.text());
  add(" ", field.unit);
  add(", ", field.presence == Presence::required ? "required" : "");
  comment(facts.empty() ? field.doc : fmt::format("{} ({})", field.doc, facts));
}

void ExperimentWriter::entry(const Field& field, const std::string& value,
                             const std::string& what) {
  document(field, what);
  const bool unit = !documented_ && *field.unit != '\0';
  line(fmt::format("{}: {}{}", field.key, value, unit ? fmt::format("  # {}", field.unit) : ""));
}

void ExperimentWriter::number(const Field& field, double& value) {
  entry(field, number_text(value), "number");
}

void ExperimentWriter::optional_number(const Field& field, std::optional<double>& value) {
  if (value) return number(field, *value);
  if (!documented_) return;
  document(field, "number");
  const auto outer = std::exchange(hint_depth_, hint_depth_.value_or(depth_));
  line(fmt::format("{}: 0", field.key));
  hint_depth_ = outer;
}

void ExperimentWriter::numbers(const Field& field, const Shape& shape,
                               std::vector<double>& values) {
  std::string value;
  if (shape.kind != Shape::Kind::list && !values.empty() && all_equal(values)) {
    value = number_text(values.front());
  } else {
    value = shape.kind == Shape::Kind::scalar_or_pairs ? pairs_text(values) : list_text(values);
  }
  entry(field, value, shape_doc(shape));
}

void ExperimentWriter::integer(const Field& field, std::int64_t& value) {
  entry(field, fmt::format("{}", value), "whole number");
}

void ExperimentWriter::integer_or_word(const Field& field, const char* word, std::int64_t& value) {
  entry(field, value == -1 ? word : fmt::format("{}", value),
        fmt::format("{} or whole number", word));
}

void ExperimentWriter::integers(const Field& field, int count, std::vector<int>& values) {
  entry(field, fmt::format("[{}]", fmt::join(values, ", ")),
        fmt::format("list of {} whole numbers", count));
}

void ExperimentWriter::flag(const Field& field, bool& value) {
  entry(field, value ? "true" : "false", "true or false");
}

void ExperimentWriter::text(const Field& field, std::string& value) {
  entry(field, in_quotes(value), "text");
}

void ExperimentWriter::choice(const Field& field, std::span<const char* const> names, int& index) {
  entry(field, names[static_cast<std::size_t>(index)],
        fmt::format("one of {}", fmt::join(names, ", ")));
}

void ExperimentWriter::matrix_or_word(const Field& field, std::span<const char* const> names,
                                      std::span<const Eigen::Matrix3d> values,
                                      Eigen::Matrix3d& value) {
  const auto known = std::find(values.begin(), values.end(), value);
  if (known != values.end()) {
    return entry(field, names[static_cast<std::size_t>(known - values.begin())], "");
  }
  std::vector<std::string> rows;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Vector3d row = value.row(i);
    rows.push_back(list_text(std::span(row.data(), 3)));
  }
  entry(field, fmt::format("[{}]", fmt::join(rows, ", ")), "");
}

void ExperimentWriter::section(const Field& field, SectionKind kind, const Body& body) {
  if (kind == SectionKind::input_only && !documented_) return;
  const bool hint = documented_ && kind != SectionKind::plain;
  if (documented_ && depth_ == 0) out_ += "\n";
  document(field, "");
  const auto outer_hint = hint_depth_;
  if (hint && !hint_depth_) hint_depth_ = depth_;
  const bool outer_brief = std::exchange(brief_, brief_ || kind == SectionKind::defaults_elsewhere);
  line(fmt::format("{}:", field.key));
  ++depth_;
  body();
  --depth_;
  hint_depth_ = outer_hint;
  brief_ = outer_brief;
}

void ExperimentWriter::items(int count, const ItemBody& item) {
  for (int i = 0; i < count; ++i) {
    depth_ += 2;
    dash_ = true;
    item(i);
    depth_ -= 2;
  }
}

void ExperimentWriter::list(const Field& field, int size, const std::function<void(int)>&,
                            const ItemBody& item) {
  if (documented_ && depth_ == 0) out_ += "\n";
  document(field, "");
  line(fmt::format("{}:", field.key));
  ++lists_;
  items(size, item);
  --lists_;
}

void ExperimentWriter::shared_or_list(const Field& field, int count, bool all_equal_items,
                                      const ItemBody& item) {
  document(field, "");
  line(fmt::format("{}:", field.key));
  if (!all_equal_items) return items(count, item);
  ++depth_;
  item(0);
  --depth_;
}

}  // namespace softarm
