#include "config/yaml_tree.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>
#include <system_error>

#include "config/hints.hpp"
#include "softarm/config/config_error.hpp"

namespace softarm {
namespace {

constexpr std::size_t kMaxFileBytes = 1 << 20;
constexpr std::size_t kMaxDepth = 16;
constexpr std::size_t kMaxIncludes = 8;
constexpr std::size_t kMaxAliased = 10000;  ///< nodes that come from aliases

using FileName = std::shared_ptr<const std::string>;

std::string quoted_excerpt(const std::string& text) {
  constexpr std::size_t kLength = 60;
  std::string out = "\"";
  for (const char c : text.substr(0, kLength)) {
    out += (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) ? '?' : c;
  }
  return out + (text.size() > kLength ? "...\"" : "\"");
}

/// Builds the tree from the parser's events, so that errors which yaml-cpp tolerates are found.
class TreeBuilder : public YAML::EventHandler {
 public:
  TreeBuilder(FileName file, const std::string& text) : file_(std::move(file)), text_(text) {}

  YamlNode take_root() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnAnchor(const YAML::Mark&, const std::string&) override {}
  /// A copy of what is at the anchor, within a bound: copies of copies double.
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto at = anchors_.find(anchor);
    if (at == anchors_.end())
      fail(mark, fmt::format("an anchor that is complete, of at most {} values", kMaxAliased),
           "another");
    YamlNode copy = at->second;
    copy.location = copy.key_location = node(mark, copy.kind).location;
    aliased_ += size_of(copy);
    if (aliased_ > kMaxAliased)
      fail(mark, fmt::format("aliases of at most {} values in all", kMaxAliased), "more");
    add(mark, std::move(copy));
  }
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    add(mark, anchored(node(mark, YamlNode::Kind::nothing), anchor));
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    check(mark, tag);
    YamlNode scalar = node(mark, YamlNode::Kind::scalar);
    scalar.text = value;
    scalar.quoted = tag == "!";
    if (scalar.quoted) check_quote(mark);
    add(mark, anchored(std::move(scalar), anchor));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    check(mark, tag);
    open(mark, YamlNode::Kind::list, anchor);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    check(mark, tag);
    open(mark, YamlNode::Kind::map, anchor);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapEnd() override { close(); }

 private:
  struct Level {
    YamlNode node;
    bool key_pending = false;  ///< a map's key has come, its value has not
    Location key_location;
    YAML::anchor_t anchor = YAML::NullAnchor;
  };

  YamlNode node(const YAML::Mark& mark, YamlNode::Kind kind) const {
    YamlNode made;
    made.kind = kind;
    made.location = {file_, mark.line + 1};
    made.key_location = made.location;
    return made;
  }

  std::string path() const {
    std::string path;
    for (const Level& level : levels_) {
      if (level.node.kind == YamlNode::Kind::list) {
        path += fmt::format("[{}]", level.node.items.size());
      } else if (level.key_pending) {
        path += (path.empty() ? "" : ".") + level.node.keys.back();
      }
    }
    return path;
  }

  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& expected,
                         const std::string& got) const {
    throw ConfigError(*file_, mark.line + 1, path(), expected, got);
  }

  /// The parser takes what follows an opening quote to the next one, however far.
  void check_quote(const YAML::Mark& mark) const {
    const auto at = static_cast<std::size_t>(mark.pos);
    if (at >= text_.size() || (text_[at] != '"' && text_[at] != '\'')) return;
    if (text_.find(text_[at], at + 1) > text_.find('\n', at))
      fail(mark, "a closing quote in the same line", "an opening one alone");
  }

  static std::size_t size_of(const YamlNode& node) {
    std::size_t size = 1;
    for (const YamlNode& item : node.items) size += size_of(item);
    return size;
  }

  YamlNode anchored(YamlNode&& made, YAML::anchor_t anchor) {
    if (anchor != YAML::NullAnchor && size_of(made) <= kMaxAliased)
      anchors_.insert_or_assign(anchor, made);
    return std::move(made);
  }

  void check(const YAML::Mark& mark, const std::string& tag) const {
    if (!tag.empty() && tag != "?" && tag != "!") fail(mark, "no tags", quoted_excerpt(tag));
  }

  void open(const YAML::Mark& mark, YamlNode::Kind kind, YAML::anchor_t anchor) {
    if (levels_.size() >= kMaxDepth) {
      fail(mark, fmt::format("at most {} levels", kMaxDepth), "more");
    }
    if (awaits_key()) fail(mark, "a word as key", "a list or section");
    levels_.push_back({node(mark, kind), false, {}, anchor});
  }

  bool awaits_key() const {
    return !levels_.empty() && levels_.back().node.kind == YamlNode::Kind::map &&
           !levels_.back().key_pending;
  }

  void add(const YAML::Mark& mark, YamlNode&& child) {
    if (!awaits_key()) return add_value(std::move(child));
    if (child.kind != YamlNode::Kind::scalar) fail(mark, "a word as key", child.describe());
    Level& level = levels_.back();
    const auto& keys = level.node.keys;
    const auto first = std::find(keys.begin(), keys.end(), child.text);
    if (first != keys.end()) {
      const int line =
          level.node.items[static_cast<std::size_t>(first - keys.begin())].key_location.line;
      const std::string key = path() + (path().empty() ? "" : ".") + child.text;
      throw ConfigError(*file_, mark.line + 1, key, "each key once",
                        fmt::format("a second one (the first is in line {})", line));
    }
    level.key_location = child.location;
    level.node.keys.push_back(std::move(child.text));
    level.key_pending = true;
  }

  void add_value(YamlNode&& child) {
    if (levels_.empty()) {
      root_ = std::move(child);
      return;
    }
    Level& level = levels_.back();
    if (level.node.kind == YamlNode::Kind::map) {
      child.key_location = level.key_location;
      // The parser notices a missing value only at the start of the next line.
      if (child.kind == YamlNode::Kind::nothing) child.location = level.key_location;
    }
    level.node.items.push_back(std::move(child));
    level.key_pending = false;
  }

  void close() {
    Level level = std::move(levels_.back());
    levels_.pop_back();
    add_value(anchored(std::move(level.node), level.anchor));
  }

  FileName file_;
  const std::string& text_;
  std::vector<Level> levels_;
  YamlNode root_;
  std::map<YAML::anchor_t, YamlNode> anchors_;
  std::size_t aliased_ = 0;
};

std::string read_text(const std::filesystem::path& file) {
  std::error_code code;
  const auto status = std::filesystem::status(file, code);
  if (!std::filesystem::exists(status)) {
    throw ConfigError(file.string(), 0, "", "a configuration file (config/ holds examples)",
                      "no such file");
  }
  if (!std::filesystem::is_regular_file(status)) {  // a pipe would be waited for
    throw ConfigError(file.string(), 0, "", "a configuration file",
                      std::filesystem::is_directory(status) ? "a folder" : "a pipe or a device");
  }
  std::ifstream stream(file, std::ios::binary);
  std::string text(kMaxFileBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (!stream.is_open() || stream.bad()) {
    throw ConfigError(file.string(), 0, "", "a readable file", "no permission to read it");
  }
  if (text.size() > kMaxFileBytes) {
    throw ConfigError(file.string(), 0, "", fmt::format("at most {} bytes", kMaxFileBytes), "more");
  }
  return text;
}

YamlNode parse(const std::filesystem::path& file) {
  const auto name = std::make_shared<const std::string>(file.string());
  const std::string text = read_text(file);
  const auto refuse = [&](int line, const std::string& expected, const std::string& got) {
    if (const auto fault = find_text_fault(text))
      throw ConfigError(*name, fault->line, fault->key, fault->expected, fault->got);
    throw ConfigError(*name, line, "", expected, got);
  };
  std::istringstream stream(text);
  TreeBuilder builder(name, text);
  try {
    YAML::Parser parser(stream);
    parser.HandleNextDocument(builder);
    TreeBuilder rest(name, text);
    if (parser.HandleNextDocument(rest)) {
      throw ConfigError(*name, 0, "", "one YAML document", "several (a line \"---\")");
    }
  } catch (const YAML::Exception& error) {
    refuse(error.mark.is_null() ? 0 : error.mark.line + 1, "valid YAML", error.msg);
  }
  YamlNode root = builder.take_root();
  if (root.kind != YamlNode::Kind::map)
    refuse(std::max(1, root.location.line), "sections (key: value)", root.describe());
  return root;
}

/// Values of `over` win; maps are merged key by key.
void merge(YamlNode& base, YamlNode&& over) {
  if (base.kind != YamlNode::Kind::map || over.kind != YamlNode::Kind::map) {
    base = std::move(over);
    return;
  }
  base.location = over.location;
  base.key_location = over.key_location;
  for (std::size_t i = 0; i < over.items.size(); ++i) {
    const auto at = std::find(base.keys.begin(), base.keys.end(), over.keys[i]);
    if (at == base.keys.end()) {
      base.keys.push_back(std::move(over.keys[i]));
      base.items.push_back(std::move(over.items[i]));
    } else {
      merge(base.items[static_cast<std::size_t>(at - base.keys.begin())], std::move(over.items[i]));
    }
  }
}

/// `chain`: the files that include one another, this one last; `files`: all read.
YamlNode read_with_includes(const std::filesystem::path& file, Files& chain, Files& files) {
  files.push_back(file);
  chain.push_back(file);
  YamlNode root = parse(file);
  const auto at = std::find(root.keys.begin(), root.keys.end(), "include");
  if (at == root.keys.end()) return root;
  const auto index = at - root.keys.begin();
  const YamlNode include = std::move(root.items[static_cast<std::size_t>(index)]);
  root.keys.erase(at);
  root.items.erase(root.items.begin() + index);
  const auto fail = [&](const std::string& expected, const std::string& got) {
    throw ConfigError(*include.location.file, include.location.line, "include", expected, got);
  };
  if (include.kind != YamlNode::Kind::scalar) fail("the name of a file", include.describe());
  std::string looked_for;
  const auto included = included_file(file, include.text, looked_for);
  if (included.empty())
    fail("an existing file, relative to this one",
         fmt::format("{} ({})", quoted_excerpt(include.text), looked_for));
  std::error_code code;
  for (const auto& outer : chain)
    if (std::filesystem::equivalent(outer, included, code))
      fail("a file that does not include this one again",
           fmt::format("{}, a circle", quoted_excerpt(include.text)));
  if (chain.size() > kMaxIncludes)
    fail(fmt::format("at most {} nested includes", kMaxIncludes), "more");
  YamlNode base = read_with_includes(included, chain, files);
  merge(base, std::move(root));
  return base;
}

}  // namespace

const YamlNode* YamlNode::find(std::string_view key) const {
  const auto at = std::find(keys.begin(), keys.end(), key);
  return at == keys.end() ? nullptr : &items[static_cast<std::size_t>(at - keys.begin())];
}

std::string YamlNode::describe() const {
  switch (kind) {
    case Kind::scalar:
      return quoted_excerpt(text) + (quoted ? " in quotes" : "");
    case Kind::list:
      return fmt::format("a list of {}", items.size());
    case Kind::map:
      return "a section";
    case Kind::nothing:
      break;
  }
  return "nothing";
}

std::filesystem::path included_file(const std::filesystem::path& from, const std::string& name,
                                    std::string& looked_for) {
  std::error_code code;
  std::filesystem::path first = from.parent_path() / name;
  const std::filesystem::path real = std::filesystem::canonical(from, code).parent_path() / name;
  looked_for = "no file " + first.string();
  if (std::filesystem::is_regular_file(first, code)) return first;
  if (code || !std::filesystem::equivalent(real.parent_path(), first.parent_path(), code) || code)
    looked_for += " and none " + real.string();
  return std::filesystem::is_regular_file(real, code) ? real : std::filesystem::path();
}

YamlNode read_yaml_file(const std::filesystem::path& file, Files& files) {
  Files chain;
  return read_with_includes(file, chain, files);
}

}  // namespace softarm
