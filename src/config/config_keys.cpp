#include "softarm/config/config_keys.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <set>
#include <utility>

#include "config/hints.hpp"
#include "config/parsed_number.hpp"
#include "config/yaml_tree.hpp"

namespace softarm {
namespace {

constexpr std::size_t kLongestList = 256;

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

/// @param fix  what would be right, where that is known
[[noreturn]] void fail(const YamlNode& node, const std::string& path, const std::string& expected,
                       const std::string& fix = "") {
  throw ConfigError(*node.location.file, node.location.line, path, expected,
                    node.describe() + (fix.empty() ? "" : " (" + fix + ")"));
}

/// "a.b[1].c" without indices.
std::string without_indices(std::string_view path) {
  std::string out;
  bool index = false;
  for (const char c : path) {
    if (c == '[') index = true;
    if (!index) out += c;
    if (c == ']') index = false;
  }
  return out;
}

/// Appends the numbers of a node to `out`.
struct NumberReader {
  const Form& form;
  const std::string& expected;
  std::string_view unit;
  bool any_size;  ///< what the size follows from is wrong itself
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
    if (node.kind != YamlNode::Kind::list || innermost || size == 0)
      fail(node, path, expected,
           node.kind == YamlNode::Kind::scalar ? likely_fix(node.text, node.quoted, form, unit)
                                               : "");
    const int wanted = form.sizes[depth];
    const bool counted = wanted != Form::kAny && !(any_size && depth == 0);
    if (counted ? size != static_cast<std::size_t>(wanted) : size > kLongestList)
      fail(node, path, expected,
           counted && size == 2 * static_cast<std::size_t>(wanted)
               ? "numbers with decimal commas? write decimal points"
               : "");
    for (std::size_t i = 0; i < size; ++i)
      read(node.items[i], fmt::format("{}[{}]", path, i), depth + 1);
  }

  double number(const YamlNode& node, const std::string& path) const {
    auto value = plain_number(node.text);
    if (form.whole && !parsed<std::int64_t>(node.text)) value.reset();
    if (!value && unit == "rad") value = multiple_of_pi(node.text);
    if (node.quoted || !value || !std::isfinite(*value) || !form.contains(*value))
      fail(node, path, expected, likely_fix(node.text, node.quoted, form, unit));
    return *value == 0.0 ? 0.0 : *value;  // no negative zero: what is printed reads back the same
  }
};

}  // namespace

struct ConfigKeys::Frame {
  const YamlNode* node;
  std::string path;
  bool quiet = false;                     ///< the section is missing or none: its keys are too
  bool failed = false;                    ///< a value of it is wrong
  bool kind_known = true;                 ///< the word that decides which keys there are
  std::set<std::string_view> known = {};  ///< keys declared

  std::string path_of(std::string_view key) const {
    return path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
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
    : purpose_(Purpose::read),
      root_(std::make_unique<const YamlNode>(read_yaml_file(file, files_))) {}

ConfigKeys::~ConfigKeys() = default;

Entry ConfigKeys::visit(const Body& describe) {
  Entry root{{"", ""}, Entry::Kind::section};
  enter(root, root_.get(), "", describe);
  throw_errors();
  return root;
}

void ConfigKeys::report(const ConfigError& error) {
  if (!frames_.empty()) frames_.back().failed = true;
  errors_.push_back(error);
}

/// Unknown keys, each with the one that was probably meant, which then is not missing.
void ConfigKeys::report_unknown() {
  for (const Unknown& it : unknown_) {
    const std::string& key = it.section->keys[it.index];
    const std::string path = it.path.empty() ? key : fmt::format("{}.{}", it.path, key);
    const Location& at = it.section->items[it.index].key_location;
    std::set<std::string> taken;
    const std::string section = without_indices(it.path);
    for (std::size_t i = 0; i < it.section->keys.size(); ++i)  // what is included may be meant
      if (*it.section->items[i].key_location.file == *at.file)
        taken.insert(section.empty() ? it.section->keys[i]
                                     : fmt::format("{}.{}", section, it.section->keys[i]));
    // "{a: 0,5}" is read as a: 0 and 5: nothing.
    if (it.index > 0 && key.find_first_not_of("0123456789") == std::string::npos &&
        it.section->items[it.index].kind == YamlNode::Kind::nothing &&
        it.section->items[it.index - 1].kind == YamlNode::Kind::scalar) {
      const std::string& before = it.section->items[it.index - 1].text;
      errors_.emplace_back(
          *at.file, at.line,
          path.substr(0, path.size() - key.size()) + it.section->keys[it.index - 1],
          fmt::format("a decimal point ({}.{})", before, key),
          fmt::format("a comma (\"{},{}\")", before, key));
      continue;
    }
    const std::string meant = nearest_key(without_indices(path), declared_, taken);
    std::erase_if(missing_, [&](const ConfigError& each) {
      const std::string lacking = without_indices(each.key);
      return lacking == meant || meant.starts_with(lacking + ".");
    });
    const bool here =
        !meant.empty() && meant.size() > section.size() &&
        meant.substr(0, section.size()) == section &&
        meant.find('.', section.empty() ? 0 : section.size() + 1) == std::string::npos;
    const std::string name = here ? meant.substr(section.empty() ? 0 : section.size() + 1) : meant;
    errors_.emplace_back(*at.file, at.line, path,
                         !meant.empty()     ? name
                         : it.known.empty() ? "no keys"
                                            : fmt::format("one of {}", fmt::join(it.known, ", ")),
                         meant.empty() ? "an unknown key"
                         : here        ? fmt::format("an unknown key (did you mean {}?)", name)
                                : fmt::format("an unknown key here (did you mean {}?)", name));
  }
}

void ConfigKeys::throw_errors() {
  report_unknown();
  errors_.insert(errors_.end(), missing_.begin(), missing_.end());
  if (errors_.empty()) return;
  const auto place = [this](const ConfigError& error) {
    const auto file = std::find(files_.begin(), files_.end(), error.file);
    return std::pair(file - files_.begin(), error.line);
  };
  std::stable_sort(errors_.begin(), errors_.end(),
                   [&](const ConfigError& a, const ConfigError& b) { return place(a) < place(b); });
  const auto same = [](const ConfigError& a, const ConfigError& b) {
    return std::string_view(a.what()) == b.what();
  };
  errors_.erase(std::unique(errors_.begin(), errors_.end(), same), errors_.end());
  throw ConfigErrors(errors_);
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

std::filesystem::path ConfigKeys::beside(const char* key, const std::filesystem::path& path) const {
  if (frames_.empty()) return path;
  const auto found = locations_.find(frames_.back().path_of(key));
  if (found == locations_.end()) return path;
  return std::filesystem::path(*found->second.file).parent_path() / path;
}

/// What stands at a key of the section being read; nullptr where it is left out.
const YamlNode* ConfigKeys::take(const Key& key, const std::string& expected) {
  if (!reading()) return nullptr;
  Frame& frame = frames_.back();
  frame.known.insert(key.name);
  const std::string path = frame.path_of(key.name);
  declared_.insert(without_indices(path));
  const YamlNode* node = frame.node->find(key.name);
  if (node != nullptr) {
    locations_.insert_or_assign(path, node->key_location);
  } else if (key.presence == Presence::required && !frame.quiet && frame.kind_known) {
    const Location& at = frame.node->key_location;
    missing_.emplace_back(*at.file, at.line, path, expected, "nothing: the key is missing");
    frame.failed = true;
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
    enter_section(node, path, body);
  }
  entries_ = outer;
}

/// Reads a section. What is wrong is noted, and what follows is read all the same.
void ConfigKeys::enter_section(const YamlNode* node, const std::string& path, const Body& body) {
  YamlNode none;
  bool quiet = false;
  if (node->kind != YamlNode::Kind::map) {
    report({*node->location.file, node->location.line, path, "a section", node->describe()});
    none.kind = YamlNode::Kind::map;
    none.location = node->location;
    none.key_location = node->key_location;
    node = &none;
    quiet = true;
  }
  const std::size_t index = frames_.size();
  frames_.push_back({node, path, quiet || (index > 0 && frames_.back().quiet)});
  const bool clean = errors_.empty() && missing_.empty();
  try {
    body();
  } catch (const ConfigError& error) {
    errors_.push_back(error);
  } catch (const std::exception&) {  // of what follows from a wrong value
    if (clean && errors_.empty() && missing_.empty()) throw;
  }
  Frame& frame = frames_[index];
  for (std::size_t i = 0; i < node->keys.size(); ++i)
    if (frame.kind_known && !frame.known.contains(node->keys[i]))
      unknown_.push_back({node, i, path, {frame.known.begin(), frame.known.end()}});
  frames_.resize(index);
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

void ConfigKeys::refuse(const char* key, const char* why) {
  if (!reading()) return;
  Frame& frame = frames_.back();
  frame.known.insert(key);
  if (const YamlNode* node = frame.node->find(key))
    report({*node->key_location.file, node->key_location.line, frame.path_of(key),
            fmt::format("nothing: {}", why), node->describe()});
}

void ConfigKeys::either(const char* exact, const Body& exact_body, const char* friendly,
                        const Body& friendly_body) {
  bool as_exact = purpose_ == Purpose::print;
  if (reading()) {
    const Frame& frame = frames_.back();
    const YamlNode* node = frame.node->find(exact);
    as_exact = node != nullptr;
    if (as_exact && frame.node->find(friendly) != nullptr) {
      report({*node->key_location.file, node->key_location.line, frame.path_of(exact),
              fmt::format("either {} or {}", exact, friendly), "both"});
      frames_.back().kind_known = false;
    }
  }
  when(as_exact, exact_body);
  when(!as_exact, friendly_body);
}

void ConfigKeys::read_numbers(const YamlNode& node, const Key& key, const Form& form,
                              const std::string& expected, std::vector<double>& numbers) {
  const std::string path = frames_.back().path_of(key.name);
  const bool scalar = node.kind == YamlNode::Kind::scalar;
  const bool word_allowed = scalar && !(node.quoted && form.is_flag());
  const Form::Word* word = word_allowed ? form.find(node.text) : nullptr;
  if (word != nullptr) {
    numbers = word->numbers;
    return;
  }
  if (!form.numeric)
    fail(node, path, expected, scalar ? likely_fix(node.text, node.quoted, form, "") : "");
  const bool any_size = form.sized_by_keys && (!sizes_known_ || frames_.back().failed);
  std::vector<double> read;
  NumberReader{form, expected, key.unit(), any_size, read}.read(node, path, 0);
  if (!any_size) numbers = std::move(read);
}

void ConfigKeys::visit_numbers(const Key& key, const Form& form, std::vector<double>& numbers) {
  const std::string expected = form.text(key.unit());
  const std::size_t before = errors_.size() + missing_.size();
  if (const YamlNode* node = take(key, expected)) {
    try {
      read_numbers(*node, key, form, expected, numbers);
    } catch (const ConfigError& error) {  // the variable keeps its value
      report(error);
    }
  }
  if (errors_.size() + missing_.size() > before) {  // what follows from this value is not known
    if (form.whole && form.sizes.empty()) sizes_known_ = false;
    if (!form.numeric && !form.is_flag()) frames_.back().kind_known = false;
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
    const bool good = node->kind == YamlNode::Kind::scalar && printable && is_utf8(node->text) &&
                      length.contains(static_cast<double>(node->text.size()));
    if (good) {
      value = node->text;
    } else {
      const bool other = node->kind == YamlNode::Kind::scalar && !is_utf8(node->text);
      report({*node->location.file, node->location.line, frames_.back().path_of(key.name), expected,
              other ? "bytes that are not UTF-8: save the file as UTF-8, it may be Latin-1"
                    : node->describe()});
    }
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
  const bool absent = node == nullptr && key.presence == Presence::required;
  if (absent) sizes_known_ = false;
  // One that is left out is visited too: its defaults may depend on what was read before.
  YamlNode empty;
  empty.kind = YamlNode::Kind::map;
  empty.location = frame.node->location;
  empty.key_location = frame.node->key_location;
  const bool quiet = std::exchange(frames_.back().quiet, frame.quiet || absent);
  enter(entry, node != nullptr ? node : &empty, frames_.back().path_of(key.name), body);
  frames_.back().quiet = quiet;
}

void ConfigKeys::visit_list(const Key& key, int size, const ItemBody& resize,
                            const ItemBody& item) {
  const YamlNode* node = take(key, "a list of sections");
  if (node != nullptr) {
    const std::size_t count = node->items.size();
    if (node->kind != YamlNode::Kind::list || count == 0 || count > kLongestList)
      return report({*node->location.file, node->location.line, frames_.back().path_of(key.name),
                     fmt::format("a list of 1 to {} sections", kLongestList),
                     node->kind == YamlNode::Kind::map
                         ? "a section (begin its first key with \"- \")"
                         : node->describe()});
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
      (node->kind != YamlNode::Kind::list ||
       node->items.size() != static_cast<std::size_t>(count))) {
    if (node->kind != YamlNode::Kind::list || sizes_known_)
      report({*node->location.file, node->location.line, frames_.back().path_of(key.name),
              fmt::format("one section or a list of {}", count), node->describe()});
    return;
  }
  if (node != nullptr || !reading())
    enter_items(add(key, Entry::Kind::one_or_each), node, reading() || !all_equal ? count : 1,
                item);
}

}  // namespace softarm
