#include "config/yaml_tree.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <system_error>

#include "softarm/config/config_error.hpp"

namespace softarm {
namespace {

constexpr std::size_t kMaxFileBytes = 1 << 20;
constexpr std::size_t kMaxDepth = 16;
constexpr int kMaxIncludes = 8;

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
  explicit TreeBuilder(FileName file) : file_(std::move(file)) {}

  YamlNode take_root() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnAnchor(const YAML::Mark& mark, const std::string& name) override {
    fail(mark, "no anchors or aliases", "&" + name);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    fail(mark, "no anchors or aliases", "an alias");
  }
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    check(mark, "", anchor);
    add(mark, node(mark, YamlNode::Kind::nothing));
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    check(mark, tag, anchor);
    YamlNode scalar = node(mark, YamlNode::Kind::scalar);
    scalar.text = value;
    scalar.quoted = tag == "!";
    add(mark, std::move(scalar));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    check(mark, tag, anchor);
    open(mark, YamlNode::Kind::list);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    check(mark, tag, anchor);
    open(mark, YamlNode::Kind::map);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapEnd() override { close(); }

 private:
  struct Level {
    YamlNode node;
    bool key_pending = false;  ///< a map's key has come, its value has not
    Location key_location;
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

  void check(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor) const {
    if (anchor != YAML::NullAnchor) fail(mark, "no anchors or aliases", "an anchor");
    if (!tag.empty() && tag != "?" && tag != "!") fail(mark, "no tags", quoted_excerpt(tag));
  }

  void open(const YAML::Mark& mark, YamlNode::Kind kind) {
    if (levels_.size() >= kMaxDepth) {
      fail(mark, fmt::format("at most {} levels", kMaxDepth), "more");
    }
    if (awaits_key()) fail(mark, "a word as key", "a list or section");
    levels_.push_back({node(mark, kind), false, {}});
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
    YamlNode done = std::move(levels_.back().node);
    levels_.pop_back();
    add_value(std::move(done));
  }

  FileName file_;
  std::vector<Level> levels_;
  YamlNode root_;
};

std::string read_text(const std::filesystem::path& file) {
  std::error_code code;
  const auto status = std::filesystem::status(file, code);
  if (!std::filesystem::exists(status)) {
    throw ConfigError(file.string(), 0, "", "a configuration file (config/ holds examples)",
                      "no such file");
  }
  if (std::filesystem::is_directory(status)) {
    throw ConfigError(file.string(), 0, "", "a configuration file", "a folder");
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
  std::istringstream stream(read_text(file));
  TreeBuilder builder(name);
  try {
    YAML::Parser parser(stream);
    parser.HandleNextDocument(builder);
    TreeBuilder rest(name);
    if (parser.HandleNextDocument(rest)) {
      throw ConfigError(*name, 0, "", "one YAML document", "several (a line \"---\")");
    }
  } catch (const YAML::Exception& error) {
    throw ConfigError(*name, error.mark.is_null() ? 0 : error.mark.line + 1, "", "valid YAML",
                      error.msg);
  }
  YamlNode root = builder.take_root();
  if (root.kind != YamlNode::Kind::map) {
    throw ConfigError(*name, std::max(1, root.location.line), "", "sections (key: value)",
                      root.describe());
  }
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

YamlNode read_with_includes(const std::filesystem::path& file, int depth) {
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
  if (depth >= kMaxIncludes) fail(fmt::format("at most {} nested includes", kMaxIncludes), "more");
  const auto included = file.parent_path() / include.text;
  std::error_code code;
  if (!std::filesystem::is_regular_file(included, code)) {
    fail("an existing file, relative to this one", quoted_excerpt(include.text));
  }
  YamlNode base = read_with_includes(included, depth + 1);
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

YamlNode read_yaml_file(const std::filesystem::path& file) { return read_with_includes(file, 0); }

}  // namespace softarm
