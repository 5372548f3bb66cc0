#include "config/reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <numeric>

namespace softarm {
namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t kept = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({kept, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

/// Close enough that one may be the other misspelt. Unit suffixes forgotten or wrong count as
/// close.
bool similar(std::string_view a, std::string_view b) {
  constexpr std::size_t kLongestKey = 64;
  if (a.size() > kLongestKey) return false;
  const std::size_t shorter = std::min(a.size(), b.size());
  const std::size_t longer = std::max(a.size(), b.size());
  const bool prefix = shorter >= 4 && a.substr(0, shorter) == b.substr(0, shorter);
  return prefix || edit_distance(a, b) <= std::max<std::size_t>(1, longer / 4);
}

std::optional<double> plain_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || text.empty()) return {};
  return value;
}

/// An angle as people write it: "pi", "-pi/2", "3*pi/4", "0.2*pi/180".
std::optional<double> multiple_of_pi(std::string_view text) {
  double sign = 1.0;
  if (text.starts_with('-') || text.starts_with('+')) {
    sign = text.front() == '-' ? -1.0 : 1.0;
    text.remove_prefix(1);
  }
  double factor = 1.0;
  double divisor = 1.0;
  if (const auto star = text.find('*'); star != std::string_view::npos) {
    const auto parsed = plain_number(text.substr(0, star));
    if (!parsed || !(*parsed >= 0.0)) return {};
    factor = *parsed;
    text.remove_prefix(star + 1);
  }
  if (!text.starts_with("pi")) return {};
  text.remove_prefix(2);
  if (text.starts_with('/')) {
    const auto parsed = plain_number(text.substr(1));
    if (!parsed || !(*parsed > 0.0)) return {};
    divisor = *parsed;
    text = {};
  }
  if (!text.empty()) return {};
  return sign * factor * std::numbers::pi / divisor;
}

bool is_angle(const Field& field) { return std::string_view(field.unit) == "rad"; }

std::string with_unit_and_range(const std::string& what, const Field& field) {
  std::string text = what;
  if (const std::string range = field.range.text(); !range.empty()) text += " " + range;
  if (*field.unit != '\0') text += std::string(" ") + field.unit;
  return text;
}

std::string shape_text(const Field& field, const Shape& shape) {
  const std::string each = with_unit_and_range("", field);
  switch (shape.kind) {
    case Shape::Kind::list:
      return (shape.count == 0 ? "a list of numbers"
                               : fmt::format("a list of {} numbers", shape.count)) +
             each;
    case Shape::Kind::scalar_or_list:
      return fmt::format("a number or a list of {}", shape.count) + each;
    case Shape::Kind::scalar_or_pairs:
      return fmt::format("a number or a list of {} numbers or pairs", shape.count) + each;
    case Shape::Kind::matrix:
      break;
  }
  return fmt::format("{0} rows of {0} numbers", shape.count) + each;
}

constexpr std::size_t kLongestList = 256;

}  // namespace

void ExperimentReader::read(const Body& describe) { enter(*root_, "", describe); }

ConfigError ExperimentReader::error_at(const std::string& path, const std::string& expected,
                                       const std::string& got) const {
  for (std::string at = path; !at.empty();) {
    if (const auto found = locations_.find(at); found != locations_.end()) {
      return {*found->second.file, found->second.line, path, expected, got};
    }
    const auto cut = at.find_last_of(".[");
    at.resize(cut == std::string::npos ? 0 : cut);
  }
  return {*root_->location.file, root_->location.line, path, expected, got};
}

void ExperimentReader::fail(const YamlNode& node, const std::string& path,
                            const std::string& expected, const std::string& got) const {
  throw ConfigError(*node.location.file, node.location.line, path, expected, got);
}

std::string ExperimentReader::path_of(const char* key) const {
  const std::string& path = frames_.back().path;
  return path.empty() ? key : path + "." + key;
}

bool ExperimentReader::prefers(const char* first, const char* second) {
  const YamlNode* node = frames_.back().node;
  const YamlNode* one = node->find(first);
  if (one == nullptr) return false;
  if (node->find(second) != nullptr) {
    throw ConfigError(*one->key_location.file, one->key_location.line, path_of(first),
                      fmt::format("either {} or {}", first, second), "both");
  }
  return true;
}

const YamlNode* ExperimentReader::take(const Field& field, const std::string& expected) {
  Frame& frame = frames_.back();
  frame.known.insert(field.key);
  const YamlNode* node = frame.node->find(field.key);
  if (node != nullptr) {
    locations_.insert_or_assign(path_of(field.key), node->key_location);
  } else if (field.presence == Presence::required && !frame.missing) {
    frame.missing.emplace(*frame.node->key_location.file, frame.node->key_location.line,
                          path_of(field.key), expected, "nothing: the key is missing");
    frame.missing_key = field.key;
  }
  return node;
}

void ExperimentReader::refuse_unknown(const Frame& frame) const {
  for (std::size_t i = 0; i < frame.node->keys.size(); ++i) {
    const std::string& key = frame.node->keys[i];
    if (frame.known.contains(key)) continue;
    const Location& at = frame.node->items[i].key_location;
    std::string got = "an unknown key";
    const auto guess = std::find_if(frame.known.begin(), frame.known.end(), [&](const auto& known) {
      return frame.node->find(known) == nullptr && similar(key, known);
    });
    if (guess != frame.known.end()) got += fmt::format(" (did you mean {}?)", *guess);
    throw ConfigError(
        *at.file, at.line, frame.path.empty() ? key : frame.path + "." + key,
        frame.known.empty() ? "no keys" : fmt::format("one of {}", fmt::join(frame.known, ", ")),
        got);
  }
}

/// After an error that a missing key may have caused: an unknown key that resembles it is the
/// likelier fault.
void ExperimentReader::refuse_misspelt(const Frame& frame) const {
  for (std::size_t i = 0; i < frame.node->keys.size(); ++i) {
    const std::string& key = frame.node->keys[i];
    if (frame.known.contains(key) || !similar(key, frame.missing_key)) continue;
    const Location& at = frame.node->items[i].key_location;
    throw ConfigError(*at.file, at.line, frame.path.empty() ? key : frame.path + "." + key,
                      frame.missing_key, "an unknown key");
  }
}

void ExperimentReader::enter(const YamlNode& node, const std::string& path, const Body& body) {
  if (node.kind != YamlNode::Kind::map) fail(node, path, "a section", node.describe());
  const std::size_t index = frames_.size();
  frames_.push_back({&node, path, {}, {}, {}});
  try {
    body();
  } catch (const ConfigError&) {
    const Frame frame = frames_[index];
    if (!frame.missing) throw;
    refuse_misspelt(frame);
    throw *frame.missing;
  }
  const Frame frame = std::move(frames_.back());
  frames_.pop_back();
  refuse_unknown(frame);
  if (frame.missing) throw *frame.missing;
}

double ExperimentReader::scalar(const Field& field, const YamlNode& node, const std::string& path,
                                const std::string& expected) const {
  std::optional<double> value;
  if (node.kind == YamlNode::Kind::scalar && !node.quoted) {
    value = plain_number(node.text);
    if (!value && is_angle(field)) value = multiple_of_pi(node.text);
  }
  if (!value || !std::isfinite(*value) || !field.range.contains(*value)) {
    fail(node, path, expected, node.describe());
  }
  return *value == 0.0 ? 0.0 : *value;  // no negative zero: what is printed reads back the same
}

std::int64_t ExperimentReader::whole(const Field& field, const YamlNode& node,
                                     const std::string& path, const std::string& expected) const {
  std::int64_t value = 0;
  const char* end = node.text.data() + node.text.size();
  const auto parsed = std::from_chars(node.text.data(), end, value);
  if (node.kind != YamlNode::Kind::scalar || node.quoted || node.text.empty() ||
      parsed.ec != std::errc() || parsed.ptr != end ||
      !field.range.contains(static_cast<double>(value))) {
    fail(node, path, expected, node.describe());
  }
  return value;
}

void ExperimentReader::number(const Field& field, double& value) {
  const std::string expected = with_unit_and_range("a number", field);
  if (const YamlNode* node = take(field, expected)) {
    value = scalar(field, *node, path_of(field.key), expected);
  }
}

void ExperimentReader::optional_number(const Field& field, std::optional<double>& value) {
  const std::string expected = with_unit_and_range("a number", field);
  if (const YamlNode* node = take(field, expected)) {
    value = scalar(field, *node, path_of(field.key), expected);
  }
}

void ExperimentReader::append_pair(const Field& field, const YamlNode& node,
                                   const std::string& path, const std::string& expected,
                                   std::vector<double>& values) const {
  if (node.kind == YamlNode::Kind::list) {
    if (node.items.size() != 2) fail(node, path, expected, node.describe());
    for (std::size_t j = 0; j < 2; ++j) {
      values.push_back(scalar(field, node.items[j], fmt::format("{}[{}]", path, j), expected));
    }
  } else {
    values.insert(values.end(), 2, scalar(field, node, path, expected));
  }
}

void ExperimentReader::numbers(const Field& field, const Shape& shape,
                               std::vector<double>& values) {
  const std::string expected = shape_text(field, shape);
  const YamlNode* node = take(field, expected);
  if (node == nullptr) return;
  const std::string path = path_of(field.key);
  const bool pairs = shape.kind == Shape::Kind::scalar_or_pairs;
  if (node->kind == YamlNode::Kind::scalar && shape.kind != Shape::Kind::list) {
    const int count = pairs ? 2 * shape.count : shape.count;
    values.assign(static_cast<std::size_t>(count), scalar(field, *node, path, expected));
    return;
  }
  const auto count = static_cast<std::size_t>(shape.count);
  const std::size_t size = node->items.size();
  if (node->kind != YamlNode::Kind::list || (count > 0 && size != count) || size == 0 ||
      size > kLongestList) {
    fail(*node, path, expected, node->describe());
  }
  values.clear();
  for (std::size_t i = 0; i < size; ++i) {
    const std::string at = fmt::format("{}[{}]", path, i);
    if (pairs) {
      append_pair(field, node->items[i], at, expected, values);
    } else {
      values.push_back(scalar(field, node->items[i], at, expected));
    }
  }
}

void ExperimentReader::integer(const Field& field, std::int64_t& value) {
  const std::string expected = with_unit_and_range("a whole number", field);
  if (const YamlNode* node = take(field, expected)) {
    value = whole(field, *node, path_of(field.key), expected);
  }
}

void ExperimentReader::integer_or_word(const Field& field, const char* word, std::int64_t& value) {
  const std::string expected =
      with_unit_and_range(fmt::format("{} or a whole number", word), field);
  const YamlNode* node = take(field, expected);
  if (node == nullptr) return;
  const bool is_word = node->kind == YamlNode::Kind::scalar && node->text == word;
  value = is_word ? -1 : whole(field, *node, path_of(field.key), expected);
}

void ExperimentReader::integers(const Field& field, int count, std::vector<int>& values) {
  const std::string expected =
      with_unit_and_range(fmt::format("a list of {} whole numbers", count), field);
  const YamlNode* node = take(field, expected);
  if (node == nullptr) return;
  const std::string path = path_of(field.key);
  if (node->kind != YamlNode::Kind::list || node->items.size() != static_cast<std::size_t>(count)) {
    fail(*node, path, expected, node->describe());
  }
  values.clear();
  for (std::size_t i = 0; i < node->items.size(); ++i) {
    values.push_back(
        static_cast<int>(whole(field, node->items[i], fmt::format("{}[{}]", path, i), expected)));
  }
}

void ExperimentReader::flag(const Field& field, bool& value) {
  const YamlNode* node = take(field, "true or false");
  if (node == nullptr) return;
  const bool is_true = node->text == "true";
  if (node->kind != YamlNode::Kind::scalar || node->quoted || !(is_true || node->text == "false")) {
    fail(*node, path_of(field.key), "true or false", node->describe());
  }
  value = is_true;
}

void ExperimentReader::text(const Field& field, std::string& value) {
  const std::string expected =
      fmt::format("a text of {} to {} printable characters", field.range.low, field.range.high);
  const YamlNode* node = take(field, expected);
  if (node == nullptr) return;
  const bool printable = std::none_of(node->text.begin(), node->text.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
  });
  if (node->kind != YamlNode::Kind::scalar || !printable ||
      !field.range.contains(static_cast<double>(node->text.size()))) {
    fail(*node, path_of(field.key), expected, node->describe());
  }
  value = node->text;
}

void ExperimentReader::choice(const Field& field, std::span<const char* const> names, int& index) {
  const std::string expected = fmt::format("one of {}", fmt::join(names, ", "));
  const YamlNode* node = take(field, expected);
  if (node == nullptr) return;
  const auto at = std::find(names.begin(), names.end(), node->text);
  if (node->kind != YamlNode::Kind::scalar || at == names.end()) {
    fail(*node, path_of(field.key), expected, node->describe());
  }
  index = static_cast<int>(at - names.begin());
}

void ExperimentReader::matrix_or_word(const Field& field, std::span<const char* const> names,
                                      std::span<const Eigen::Matrix3d> values,
                                      Eigen::Matrix3d& value) {
  const std::string expected = fmt::format("{} or 3 rows of 3 numbers", fmt::join(names, ", "));
  const YamlNode* node = take(field, expected);
  if (node == nullptr) return;
  const std::string path = path_of(field.key);
  if (node->kind == YamlNode::Kind::scalar) {
    const auto at = std::find(names.begin(), names.end(), node->text);
    if (at == names.end()) fail(*node, path, expected, node->describe());
    value = values[static_cast<std::size_t>(at - names.begin())];
    return;
  }
  if (node->kind != YamlNode::Kind::list || node->items.size() != 3) {
    fail(*node, path, expected, node->describe());
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const YamlNode& row = node->items[i];
    const std::string at = fmt::format("{}[{}]", path, i);
    if (row.kind != YamlNode::Kind::list || row.items.size() != 3) {
      fail(row, at, expected, row.describe());
    }
    for (std::size_t j = 0; j < 3; ++j) {
      value(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          scalar(field, row.items[j], fmt::format("{}[{}]", at, j), expected);
    }
  }
}

void ExperimentReader::section(const Field& field, SectionKind, const Body& body) {
  if (const YamlNode* node = take(field, "a section")) {
    enter(*node, path_of(field.key), body);
  } else if (field.presence == Presence::optional) {
    YamlNode empty;
    empty.kind = YamlNode::Kind::map;
    empty.location = frames_.back().node->location;
    empty.key_location = frames_.back().node->key_location;
    enter(empty, path_of(field.key), body);  // defaults may depend on what was read before
  } else {
    refuse_misspelt(frames_.back());
    throw *frames_.back().missing;  // what follows may depend on it
  }
}

void ExperimentReader::list(const Field& field, int, const std::function<void(int)>& resize,
                            const ItemBody& item) {
  const YamlNode* node = take(field, "a list of sections");
  if (node == nullptr) return;
  const std::string path = path_of(field.key);
  if (node->kind != YamlNode::Kind::list || node->items.empty() ||
      node->items.size() > kLongestList) {
    fail(*node, path, fmt::format("a list of 1 to {} sections", kLongestList), node->describe());
  }
  resize(static_cast<int>(node->items.size()));
  for (std::size_t i = 0; i < node->items.size(); ++i) {
    const std::string at = fmt::format("{}[{}]", path, i);
    locations_.insert_or_assign(at, node->items[i].location);
    enter(node->items[i], at, [&] { item(static_cast<int>(i)); });
  }
}

void ExperimentReader::shared_or_list(const Field& field, int count, bool, const ItemBody& item) {
  const YamlNode* node = take(field, "a section");
  if (node == nullptr) return;
  const std::string path = path_of(field.key);
  if (node->kind == YamlNode::Kind::map) {
    for (int i = 0; i < count; ++i) {
      enter(*node, path, [&] { item(i); });
    }
    return;
  }
  if (node->kind != YamlNode::Kind::list || node->items.size() != static_cast<std::size_t>(count)) {
    fail(*node, path, fmt::format("one section or a list of {}", count), node->describe());
  }
  for (int i = 0; i < count; ++i) {
    const std::string at = fmt::format("{}[{}]", path, i);
    const YamlNode& section = node->items[static_cast<std::size_t>(i)];
    locations_.insert_or_assign(at, section.location);
    enter(section, at, [&] { item(i); });
  }
}

}  // namespace softarm
