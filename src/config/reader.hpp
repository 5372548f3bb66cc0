// The strict visitor: fills an experiment from a YAML tree, or says what is wrong and where.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "config/schema.hpp"
#include "config/yaml_tree.hpp"
#include "softarm/config/config_error.hpp"

namespace softarm {

class ExperimentReader : public SchemaVisitor {
 public:
  /// `root` is a map and outlives the reader.
  explicit ExperimentReader(const YamlNode& root) : root_(&root) {}

  /// Visits `describe` with the root and refuses what it did not ask for. @throws ConfigError
  void read(const Body& describe);

  /// An error at `path` ("a.b[1].c"), or at the nearest section around it that stands in the file.
  ConfigError error_at(const std::string& path, const std::string& expected,
                       const std::string& got) const;

  /// Whether the file says anything at this path.
  bool given(std::string_view path) const { return locations_.find(path) != locations_.end(); }

  bool reading() const override { return true; }
  bool prefers(const char* first, const char* second) override;
  void number(const Field& field, double& value) override;
  void optional_number(const Field& field, std::optional<double>& value) override;
  void numbers(const Field& field, const Shape& shape, std::vector<double>& values) override;
  void integer(const Field& field, std::int64_t& value) override;
  void integer_or_word(const Field& field, const char* word, std::int64_t& value) override;
  void integers(const Field& field, int count, std::vector<int>& values) override;
  void flag(const Field& field, bool& value) override;
  void text(const Field& field, std::string& value) override;
  void choice(const Field& field, std::span<const char* const> names, int& index) override;
  void matrix_or_word(const Field& field, std::span<const char* const> names,
                      std::span<const Eigen::Matrix3d> values, Eigen::Matrix3d& value) override;
  void section(const Field& field, SectionKind kind, const Body& body) override;
  void list(const Field& field, int size, const std::function<void(int)>& resize,
            const ItemBody& item) override;
  void shared_or_list(const Field& field, int count, bool all_equal, const ItemBody& item) override;
  using SchemaVisitor::choice;
  using SchemaVisitor::integer;

 private:
  /// A section being read.
  struct Frame {
    const YamlNode* node;
    std::string path;
    std::set<std::string> known;  ///< keys asked for
    std::optional<ConfigError>
        missing;  ///< the first; reported after unknown keys, which may be its misspelling
    std::string missing_key;
  };

  const YamlNode* take(const Field& field, const std::string& expected);
  std::string path_of(const char* key) const;
  void enter(const YamlNode& node, const std::string& path, const Body& body);
  void refuse_unknown(const Frame& frame) const;
  void refuse_misspelt(const Frame& frame) const;
  double scalar(const Field& field, const YamlNode& node, const std::string& path,
                const std::string& expected) const;
  std::int64_t whole(const Field& field, const YamlNode& node, const std::string& path,
                     const std::string& expected) const;
  void append_pair(const Field& field, const YamlNode& node, const std::string& path,
                   const std::string& expected, std::vector<double>& values) const;
  [[noreturn]] void fail(const YamlNode& node, const std::string& path, const std::string& expected,
                         const std::string& got) const;

  const YamlNode* root_;
  std::vector<Frame> frames_;
  std::map<std::string, Location, std::less<>> locations_;  ///< of every key read
};

}  // namespace softarm
