// One declaration per key of a YAML document. It reads, prints, documents (template.yaml) and
// describes the key to editors (JSON Schema):
//
//   void describe(Keys& key, Motor& it) {
//     key("speed_radps", it.speed_radps, above(0, 100), "of the shaft");
//     key("mode", it.mode, one_of({"idle", "running"}), "at the start");  // an enum, in its order
//     key("limits", it.limits, "that stop it");  // a section: describe(key, it.limits)
//   }
//   Keys keys("motor.yaml");
//   keys.visit([&] { describe(keys, motor); });
//
// The default of a key that may be left out is what the variable holds before the visit. A name
// ends in its unit (speed_radps); what is printed as unit is taken from there.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "softarm/config/config_error.hpp"
#include "softarm/config/form.hpp"

namespace softarm {

struct YamlNode;

/// A location in a file.
struct Location {
  std::shared_ptr<const std::string> file;
  int line = 0;  ///< 1-based
};

/// Whether a key may be left out.
enum class Presence { optional, required };

/// How a section is printed.
enum class SectionKind {
  plain,
  hint,       ///< its defaults follow from other keys: a comment in the template
  input_only  ///< the same, but converted to other keys: only in the template
};

/// Name and meaning of a key.
struct Key {
  const char* name;
  const char* doc;
  Presence presence = Presence::optional;
  SectionKind kind = SectionKind::plain;

  std::string_view unit() const;  ///< from the suffix of the name; "" if it has none
};

/// A key with its value, as it was visited.
struct Entry {
  /// Type of the value.
  enum class Kind { numbers, text, section, list, one_or_each };
  Key key;
  Kind kind;
  Form form = {};
  std::vector<double> numbers = {};
  std::string text = {};
  std::vector<Entry> entries = {};  ///< keys of a section, or items, each a section
  bool conditional = false;         ///< exists only under a condition ...
  bool in_force = true;             ///< ... which is true

  /// Whether the key must be in every file.
  bool required() const { return key.presence == Presence::required && !conditional; }
  /// "nominal, of the motion capture (a number in (0, 10] s)".
  std::string documentation() const;
};

/// Visits declarations for one purpose.
class Keys {
 public:
  /// The purpose of a visit.
  enum class Purpose {
    read,      ///< fill variables from a file
    print,     ///< print variables in the exact form
    document,  ///< print variables in the readable form
    schema     ///< list all forms, whatever the conditions
  };
  using Body = std::function<void()>;
  using ItemBody = std::function<void(int)>;

  /// Visits for any purpose but `read`.
  explicit Keys(Purpose purpose);
  /// Reads a file and the files it includes. @throws ConfigError
  explicit Keys(const std::filesystem::path& file);
  ~Keys();

  int segments = 1;  ///< of the arm, for keys after `arm.segments`

  /// Visits the keys that `describe` declares; when reading, refuses all others. Returns a section.
  /// @throws ConfigError when reading
  Entry visit(const Body& describe);
  /// Whether variables are being filled from a file; defaults may then depend on keys read before.
  bool reading() const { return purpose_ == Purpose::read; }
  /// Whether the file has a key at this path ("a.b[1].c").
  bool given(std::string_view path) const { return locations_.find(path) != locations_.end(); }
  /// An error at a path, located at the nearest enclosing section that is in the file.
  ConfigError error_at(const std::string& path, const std::string& expected,
                       const std::string& got) const;

  /// A number, optional number, enum, Vector3d, rotation, or vector of numbers.
  template <typename T>
  void operator()(const char* name, T& value, Form form, const char* doc,
                  Presence presence = Presence::optional) {
    std::vector<double> numbers = numbers_of(value, form);
    visit_numbers({name, doc, presence}, form, numbers);
    assign(value, numbers);
  }
  /// A flag: false or true.
  void operator()(const char* name, bool& value, const char* doc) {
    (*this)(name, value, one_of({"false", "true"}), doc);
  }
  /// `length` of the text, in characters.
  void operator()(const char* name, std::string& value, const Form& length, const char* doc,
                  Presence presence = Presence::optional);
  /// A section whose keys `describe(key, section)` declares.
  template <typename T>
  requires std::is_class_v<T>
  void operator()(const char* name, T& value, const char* doc,
                  SectionKind kind = SectionKind::plain) {
    section({name, doc, Presence::optional, kind}, [&] { describe(*this, value); });
  }
  /// A section whose keys `body` visits.
  void section(const Key& key, const Body& body);
  /// A list of sections.
  template <typename Item, typename Describe>
  void list(const Key& key, std::vector<Item>& items, const Describe& describe_item) {
    visit_list(
        key, static_cast<int>(items.size()),
        [&](int size) { items.resize(static_cast<std::size_t>(size)); },
        [&](int i) { describe_item(items[static_cast<std::size_t>(i)]); });
  }
  /// One section for all items, or a list of sections; the number of items is given.
  template <typename Item, typename Describe>
  void one_or_each(const Key& key, std::vector<Item>& items, const Describe& describe_item) {
    const bool all_equal = std::all_of(items.begin(), items.end(),
                                       [&](const Item& item) { return item == items.front(); });
    visit_one_or_each(key, static_cast<int>(items.size()), all_equal,
                      [&](int i) { describe_item(items[static_cast<std::size_t>(i)]); });
  }
  /// Keys that exist only under a condition.
  void when(bool condition, const Body& body);
  /// Two alternative forms of the same value: a file may have one of them.
  void either(const char* exact, const Body& exact_body, const char* friendly,
              const Body& friendly_body);

 private:
  struct Frame;  ///< a section being read

  Entry& add(const Key& key, Entry::Kind kind);
  void visit_numbers(const Key& key, const Form& form, std::vector<double>& numbers);
  void visit_list(const Key& key, int size, const ItemBody& resize, const ItemBody& item);
  void visit_one_or_each(const Key& key, int count, bool all_equal, const ItemBody& item);
  const YamlNode* take(const Key& key, const std::string& expected);
  void enter(Entry& out, const YamlNode* node, const std::string& path, const Body& body);
  void enter_items(Entry& out, const YamlNode* list, int count, const ItemBody& item);

  /// The numbers of a value, matrices row by row.
  template <typename T>
  static std::vector<double> numbers_of(const T& value, Form& form) {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      form.whole = form.numeric && std::is_integral_v<T>;
      return {static_cast<double>(value)};
    } else if constexpr (std::is_same_v<T, std::optional<double>>) {
      return value ? std::vector{*value} : std::vector<double>();
    } else if constexpr (std::is_same_v<T, Eigen::Matrix3d>) {
      form.sizes = {3, 3};
      const auto rows = value.template reshaped<Eigen::RowMajor>();
      return {rows.begin(), rows.end()};
    } else {
      if (std::is_same_v<T, Eigen::Vector3d>) form.sizes = {3};
      const auto size = static_cast<int>(value.size());
      if (form.sized_by_keys) form.sizes.front() = form.sizes.size() == 2 ? size / 2 : size;
      form.whole = std::is_integral_v<typename T::value_type>;
      return {value.begin(), value.end()};
    }
  }
  template <typename T>
  static void assign(T& value, const std::vector<double>& numbers) {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      value = static_cast<T>(numbers.front());
    } else if constexpr (std::is_same_v<T, std::optional<double>>) {
      if (!numbers.empty()) value = numbers.front();
    } else if constexpr (std::is_same_v<T, Eigen::Matrix3d>) {
      value = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers.data());
    } else {
      value.resize(static_cast<decltype(value.size())>(numbers.size()));
      std::transform(numbers.begin(), numbers.end(), value.begin(),
                     [](double x) { return static_cast<typename T::value_type>(x); });
    }
  }

  Purpose purpose_;
  std::vector<Entry>* entries_ = nullptr;  ///< of the section being visited
  std::unique_ptr<const YamlNode> root_;   ///< of the file that is read
  std::vector<Frame> frames_;
  std::map<std::string, Location, std::less<>> locations_;  ///< of every key read
};

}  // namespace softarm
