#include "softarm/config/config_keys.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>
#include <utility>

#include "config/yaml_tree.hpp"

namespace softarm {
namespace {

constexpr std::size_t kLongestList = 256;

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (const char c : a) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t kept = diagonal + (c == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({kept, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

/// Whether one may be the other misspelt, or with another unit.
bool similar(std::string_view a, std::string_view b) {
  constexpr std::size_t kLongestKey = 64;
  if (a.size() > kLongestKey) return false;
  const std::size_t shorter = std::min(a.size(), b.size());
  const bool prefix = shorter >= 4 && a.substr(0, shorter) == b.substr(0, shorter);
  return prefix ||
         edit_distance(a, b) <= std::max<std::size_t>(1, std::max(a.size(), b.size()) / 4);
}

/// All of the text as a number.
template <typename T>
std::optional<double> parsed(std::string_view text) {
  T value{};
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || text.empty()) return {};
  return static_cast<double>(value);
}

std::optional<double> plain_number(std::string_view text) {
  return parsed<double>(text.substr(text.starts_with('+') ? 1 : 0));
}

/// An angle as people write it: "pi", "-pi/2", "3*pi/4", "0.2*pi/180".
std::optional<double> multiple_of_pi(std::string_view text) {
  const double sign = text.starts_with('-') ? -1.0 : 1.0;
  if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
  const std::size_t at = text.find("pi");
  if (at == std::string_view::npos) return {};
  const std::string_view before = text.substr(0, at), after = text.substr(at + 2);
  std::optional<double> factor = 1.0, divisor = 1.0;
  if (!before.empty()) factor = plain_number(before.substr(0, before.size() - 1));
  if (!after.empty()) divisor = plain_number(after.substr(1));
  const bool signs = (before.empty() || before.back() == '*') && (after.empty() || after[0] == '/');
  if (!signs || !factor || !divisor || !(*factor >= 0.0) || !(*divisor > 0.0)) return {};
  return sign * *factor * std::numbers::pi / *divisor;
}

[[noreturn]] void fail(const YamlNode& node, const std::string& path, const std::string& expected) {
  throw ConfigError(*node.location.file, node.location.line, path, expected, node.describe());
}

/// Appends the numbers of a node to `out`.
struct NumberReader {
  const Form& form;
  const std::string& expected;
  bool angle;
  std::vector<double>& out;

  void read(const YamlNode& node, const std::string& path, std::size_t depth) const {
    const bool innermost = depth == form.sizes.size();
    if (node.kind == YamlNode::Kind::scalar && (innermost || form.one_for_all)) {
      const int count = std::accumulate(form.sizes.begin() + static_cast<std::ptrdiff_t>(depth),
                                        form.sizes.end(), 1, std::multiplies<>());
      out.insert(out.end(), static_cast<std::size_t>(count), number(node, path));
      return;
    }
    const std::size_t size = node.items.size();
    if (node.kind != YamlNode::Kind::list || innermost || size == 0) fail(node, path, expected);
    const int wanted = form.sizes[depth];
    if (wanted == Form::kAny ? size > kLongestList : size != static_cast<std::size_t>(wanted))
      fail(node, path, expected);
    for (std::size_t i = 0; i < size; ++i)
      read(node.items[i], fmt::format("{}[{}]", path, i), depth + 1);
  }

  double number(const YamlNode& node, const std::string& path) const {
    auto value = form.whole ? parsed<std::int64_t>(node.text) : plain_number(node.text);
    if (!value && angle) value = multiple_of_pi(node.text);
    if (node.quoted || !value || !std::isfinite(*value) || !form.contains(*value))
      fail(node, path, expected);
    return *value == 0.0 ? 0.0 : *value;  // no negative zero: what is printed reads back the same
  }
};

}  // namespace

struct ConfigKeys::Frame {
  const YamlNode* node;
  std::string path;
  std::set<std::string_view> known = {};    ///< keys declared
  std::optional<ConfigError> missing = {};  ///< the first
  std::string_view missing_key = {};

  std::string path_of(std::string_view key) const {
    return path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
  }

  /// Refuses keys that were not declared: all of them, or those that may be the missing key
  /// misspelt.
  void refuse_unknown(bool lookalikes_only) const {
    for (std::size_t i = 0; i < node->keys.size(); ++i) {
      const std::string& key = node->keys[i];
      if (known.contains(key) || (lookalikes_only && !similar(key, missing_key))) continue;
      const auto guess = std::find_if(known.begin(), known.end(), [&](const auto& other) {
        return node->find(other) == nullptr && similar(key, other);
      });
      const std::string all =
          known.empty() ? "no keys" : fmt::format("one of {}", fmt::join(known, ", "));
      const Location& at = node->items[i].key_location;
      throw ConfigError(
          *at.file, at.line, path_of(key), lookalikes_only ? std::string(missing_key) : all,
          guess == known.end() ? "an unknown key"
                               : fmt::format("an unknown key (did you mean {}?)", *guess));
    }
  }
};

std::string Entry::documentation() const {
  std::string facts;
  if (kind == Kind::text) facts = "text";
  if (kind == Kind::numbers) facts = form.text(key.unit(), false);
  if (key.presence == Presence::required) facts += facts.empty() ? "required" : ", required";
  return facts.empty() ? key.doc : fmt::format("{} ({})", key.doc, facts);
}

ConfigKeys::ConfigKeys(Purpose purpose) : purpose_(purpose) {}

ConfigKeys::ConfigKeys(const std::filesystem::path& file)
    : purpose_(Purpose::read), root_(std::make_unique<const YamlNode>(read_yaml_file(file))) {}

ConfigKeys::~ConfigKeys() = default;

Entry ConfigKeys::visit(const Body& describe) {
  Entry root{{"", ""}, Entry::Kind::section};
  enter(root, root_.get(), "", describe);
  return root;
}

ConfigError ConfigKeys::error_at(const std::string& path, const std::string& expected,
                                 const std::string& got) const {
  Location where = root_->location;
  for (std::string at = path; !at.empty();) {
    if (const auto found = locations_.find(at); found != locations_.end()) {
      where = found->second;
      break;
    }
    const auto cut = at.find_last_of(".[");
    at.resize(cut == std::string::npos ? 0 : cut);
  }
  return {*where.file, where.line, path, expected, got};
}

/// What stands at a key of the section being read; nullptr where it is left out.
const YamlNode* ConfigKeys::take(const Key& key, const std::string& expected) {
  if (!reading()) return nullptr;
  Frame& frame = frames_.back();
  frame.known.insert(key.name);
  const YamlNode* node = frame.node->find(key.name);
  if (node != nullptr) {
    locations_.insert_or_assign(frame.path_of(key.name), node->key_location);
  } else if (key.presence == Presence::required && !frame.missing) {
    const Location& at = frame.node->key_location;
    frame.missing.emplace(*at.file, at.line, frame.path_of(key.name), expected,
                          "nothing: the key is missing");
    frame.missing_key = key.name;
  }
  return node;
}

/// Visits a section, whose keys become the entries of `out`; reading, that of `node`.
void ConfigKeys::enter(Entry& out, const YamlNode* node, const std::string& path,
                       const Body& body) {
  std::vector<Entry>* outer = std::exchange(entries_, &out.entries);
  if (!reading()) {
    body();
  } else {
    if (node->kind != YamlNode::Kind::map) fail(*node, path, "a section");
    const std::size_t index = frames_.size();
    frames_.push_back({node, path});
    try {
      body();
    } catch (const ConfigError&) {
      // A missing key is the more likely fault, and its misspelling is more likely still.
      const Frame& frame = frames_[index];
      if (!frame.missing) throw;
      frame.refuse_unknown(true);
      throw *frame.missing;
    }
    frames_.back().refuse_unknown(false);
    if (frames_.back().missing) throw *frames_.back().missing;
    frames_.pop_back();
  }
  entries_ = outer;
}

void ConfigKeys::enter_items(Entry& out, const YamlNode* list, int count, const ItemBody& item) {
  const std::string path = reading() ? frames_.back().path_of(out.key.name) : "";
  for (int i = 0; i < count; ++i) {
    const YamlNode* node = list;
    std::string at = path;
    if (list != nullptr && list->kind == YamlNode::Kind::list) {
      node = &list->items[static_cast<std::size_t>(i)];
      at = fmt::format("{}[{}]", path, i);
      locations_.insert_or_assign(at, node->location);
    }
    enter(out.entries.emplace_back(Entry{out.key, Entry::Kind::section}), node, at,
          [&] { item(i); });
  }
}

Entry& ConfigKeys::add(const Key& key, Entry::Kind kind) {
  return entries_->emplace_back(Entry{key, kind});
}

void ConfigKeys::when(bool condition, const Body& body) {
  if (!condition && purpose_ != Purpose::schema) return;
  const std::size_t first = entries_->size();
  body();
  for (std::size_t i = first; i < entries_->size(); ++i) {
    (*entries_)[i].conditional = true;
    (*entries_)[i].in_force = condition;
  }
}

void ConfigKeys::either(const char* exact, const Body& exact_body, const char* friendly,
                        const Body& friendly_body) {
  bool as_exact = purpose_ == Purpose::print;
  if (reading()) {
    const Frame& frame = frames_.back();
    const YamlNode* node = frame.node->find(exact);
    as_exact = node != nullptr;
    if (as_exact && frame.node->find(friendly) != nullptr) {
      throw ConfigError(*node->key_location.file, node->key_location.line, frame.path_of(exact),
                        fmt::format("either {} or {}", exact, friendly), "both");
    }
  }
  when(as_exact, exact_body);
  when(!as_exact, friendly_body);
}

void ConfigKeys::visit_numbers(const Key& key, const Form& form, std::vector<double>& numbers) {
  const std::string expected = form.text(key.unit());
  if (const YamlNode* node = take(key, expected)) {
    const std::string path = frames_.back().path_of(key.name);
    const bool word_allowed =
        node->kind == YamlNode::Kind::scalar && !(node->quoted && form.is_flag());
    const Form::Word* word = word_allowed ? form.find(node->text) : nullptr;
    if (word == nullptr && !form.numeric) fail(*node, path, expected);
    numbers = word != nullptr ? word->numbers : std::vector<double>();
    if (word == nullptr)
      NumberReader{form, expected, key.unit() == "rad", numbers}.read(*node, path, 0);
  }
  Entry& entry = add(key, Entry::Kind::numbers);
  entry.form = form;
  entry.numbers = numbers;
}

void ConfigKeys::visit_text(const Key& key, const Form& length, std::string& value) {
  const std::string expected =
      fmt::format("a text of {} to {} printable characters", length.low, length.high);
  if (const YamlNode* node = take(key, expected)) {
    const bool printable = std::none_of(node->text.begin(), node->text.end(), [](char c) {
      return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
    });
    if (node->kind != YamlNode::Kind::scalar || !printable ||
        !length.contains(static_cast<double>(node->text.size())))
      fail(*node, frames_.back().path_of(key.name), expected);
    value = node->text;
  }
  Entry& entry = add(key, Entry::Kind::text);
  entry.form = length;
  entry.text = value;
}

void ConfigKeys::section(const Key& key, const Body& body) {
  const YamlNode* node = take(key, "a section");
  Entry& entry = add(key, Entry::Kind::section);
  if (!reading()) return enter(entry, nullptr, "", body);
  const Frame& frame = frames_.back();
  if (node == nullptr && key.presence == Presence::required) {  // what follows may depend on it
    frame.refuse_unknown(true);
    throw *frame.missing;
  }
  // One that is left out is visited too: its defaults may depend on what was read before.
  YamlNode empty;
  empty.kind = YamlNode::Kind::map;
  empty.location = frame.node->location;
  empty.key_location = frame.node->key_location;
  enter(entry, node != nullptr ? node : &empty, frame.path_of(key.name), body);
}

void ConfigKeys::visit_list(const Key& key, int size, const ItemBody& resize,
                            const ItemBody& item) {
  const YamlNode* node = take(key, "a list of sections");
  if (node != nullptr) {
    const std::size_t count = node->items.size();
    if (node->kind != YamlNode::Kind::list || count == 0 || count > kLongestList) {
      fail(*node, frames_.back().path_of(key.name),
           fmt::format("a list of 1 to {} sections", kLongestList));
    }
    resize(size = static_cast<int>(count));
  }
  if (purpose_ == Purpose::schema && size == 0) resize(size = 1);
  if (node != nullptr || !reading()) enter_items(add(key, Entry::Kind::list), node, size, item);
}

void ConfigKeys::visit_one_or_each(const Key& key, int count, bool all_equal,
                                   const ItemBody& item) {
  const YamlNode* node = take(key, "a section");
  const bool one = node != nullptr && node->kind == YamlNode::Kind::map;
  if (node != nullptr && !one &&
      (node->kind != YamlNode::Kind::list || node->items.size() != static_cast<std::size_t>(count)))
    fail(*node, frames_.back().path_of(key.name),
         fmt::format("one section or a list of {}", count));
  if (node != nullptr || !reading())
    enter_items(add(key, Entry::Kind::one_or_each), node, reading() || !all_equal ? count : 1,
                item);
}

}  // namespace softarm
