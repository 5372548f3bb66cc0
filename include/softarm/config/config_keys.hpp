// Visits the declarations of keys (base/keys.hpp) to read a file, or to print, document or describe
// the variables:
//
//   ConfigKeys keys("motor.yaml");
//   keys.visit([&] { describe(keys, motor); });
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "softarm/base/keys.hpp"
#include "softarm/base/output_file.hpp"
#include "softarm/config/config_error.hpp"

namespace softarm {

struct YamlNode;

/// Where something stands in a file.
struct Location {
  std::shared_ptr<const std::string> file;
  int line = 0;  ///< 1-based
};

/// A key with its value, as it was visited.
struct Entry {
  /// What is in it.
  enum class Kind { numbers, text, section, list, one_or_each };
  Key key;
  Kind kind;
  Form form = {};
  std::vector<double> numbers = {};
  std::string text = {};
  std::vector<Entry> entries = {};  ///< of a section; or the items, each a section
  bool conditional = false;         ///< there under a condition only ...
  bool in_force = true;             ///< ... that holds

  bool required() const { return key.presence == Presence::required && !conditional; }
  /// "nominal, of the motion capture (a number in (0, 10] s)".
  std::string documentation() const;
};

/// Visits declarations for one purpose.
class ConfigKeys final : public Keys {
 public:
  /// What variables are visited for.
  enum class Purpose {
    read,      ///< variables from a file
    print,     ///< variables, in the form that is exact
    document,  ///< variables, in the form that is friendly
    schema     ///< all forms there are, under whatever condition
  };

  explicit ConfigKeys(Purpose purpose);
  /// Reads a file with what it includes. @throws ConfigError
  explicit ConfigKeys(const std::filesystem::path& file);
  ~ConfigKeys() override;

  /// Visits the keys that `describe` declares; reading, refuses all others. The result is a
  /// section. @throws ConfigErrors, reading: all that is wrong
  Entry visit(const Body& describe);
  /// The file and all that it includes.
  const Files& files() const { return files_; }
  /// Whether the file says anything at this path ("a.b[1].c").
  bool given(std::string_view path) const { return locations_.find(path) != locations_.end(); }
  /// An error at a path, or at the nearest section around it that the file has.
  ConfigError error_at(const std::string& path, const std::string& expected,
                       const std::string& got) const;

  bool reading() const override { return purpose_ == Purpose::read; }
  std::filesystem::path beside(const char* key, const std::filesystem::path& path) const override;
  void section(const Key& key, const Body& body) override;
  void when(bool condition, const Body& body) override;
  void refuse(const char* key, const char* why) override;
  void either(const char* exact, const Body& exact_body, const char* friendly,
              const Body& friendly_body) override;

 private:
  struct Frame;  ///< a section being read
  struct Unknown {
    const YamlNode* section;
    std::size_t index;
    std::string path;  ///< of the section
    std::vector<std::string_view> known;
  };

  void report(const ConfigError& error);
  void report_unknown();
  void throw_errors();

  Entry& add(const Key& key, Entry::Kind kind);
  void visit_numbers(const Key& key, const Form& form, std::vector<double>& numbers) override;
  void visit_text(const Key& key, const Form& length, std::string& value) override;
  void visit_list(const Key& key, int size, const ItemBody& resize, const ItemBody& item) override;
  void visit_one_or_each(const Key& key, int count, bool all_equal, const ItemBody& item) override;
  const YamlNode* take(const Key& key, const std::string& expected);
  void enter(Entry& out, const YamlNode* node, const std::string& path, const Body& body);
  void enter_section(const YamlNode* node, const std::string& path, const Body& body);
  void read_numbers(const YamlNode& node, const Key& key, const Form& form,
                    const std::string& expected, std::vector<double>& numbers);
  void enter_items(Entry& out, const YamlNode* list, int count, const ItemBody& item);

  Purpose purpose_;
  Files files_;                            ///< before root_, which fills it
  std::vector<Entry>* entries_ = nullptr;  ///< of the section being visited
  std::unique_ptr<const YamlNode> root_;   ///< of the file that is read
  std::vector<Frame> frames_;
  std::map<std::string, Location, std::less<>> locations_;  ///< of every key read
  std::set<std::string> declared_;  ///< paths of all keys visited, without indices
  bool sizes_known_ = true;         ///< of lists that follow from other keys
  std::vector<ConfigError> errors_;
  std::vector<ConfigError> missing_;
  std::vector<Unknown> unknown_;
};

}  // namespace softarm
