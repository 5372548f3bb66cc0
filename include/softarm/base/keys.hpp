// One declaration a key of a YAML document. Visitors (config/config_keys.hpp) use it to read, print
// and document the key (template.yaml) and to describe it to editors (JSON Schema):
//
//   void describe(Keys& key, Motor& it) {
//     key("speed_radps", it.speed_radps, above(0, 100), "of the shaft");
//     key("mode", it.mode, one_of({"idle", "running"}), "at the start");  // an enum, in its order
//     key("limits", it.limits, "that stop it");  // a section: describe(key, it.limits)
//   }
//
// The default of a key that may be left out is what the variable holds before the visit. A name
// ends in its unit (speed_radps); what is printed as unit is taken from there.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "softarm/base/form.hpp"

namespace softarm {

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

/// Who visits declarations.
class Keys {
 public:
  using Body = std::function<void()>;
  using ItemBody = std::function<void(int)>;

  virtual ~Keys() = default;

  // Of the arm, for keys after `arm.segments` and `actuation`.
  int segments = 1, chambers = 0;

  /// Whether variables are being filled: then defaults may follow what was read before.
  virtual bool reading() const = 0;
  /// A path that the key before it names relative to the file in which that stands.
  virtual std::filesystem::path beside(const char* key, const std::filesystem::path& path) const {
    static_cast<void>(key);
    return path;
  }

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
                  Presence presence = Presence::optional) {
    visit_text({name, doc, presence}, length, value);
  }
  /// A section whose keys `describe(key, section)` declares.
  template <typename T>
  requires std::is_class_v<T>
  void operator()(const char* name, T& value, const char* doc,
                  SectionKind kind = SectionKind::plain) {
    section({name, doc, Presence::optional, kind}, [&] { describe(*this, value); });
  }
  virtual void section(const Key& key, const Body& body) = 0;
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
  /// Keys that are there under a condition only.
  virtual void when(bool condition, const Body& body) = 0;
  /// A key that others like this section have. @param why  it must be left out here
  virtual void refuse(const char* key, const char* why) = 0;
  /// Two ways to say the same.
  virtual void either(const char* exact, const Body& exact_body, const char* friendly,
                      const Body& friendly_body) = 0;

 private:
  virtual void visit_numbers(const Key& key, const Form& form, std::vector<double>& numbers) = 0;
  virtual void visit_text(const Key& key, const Form& length, std::string& value) = 0;
  virtual void visit_list(const Key& key, int size, const ItemBody& resize,
                          const ItemBody& item) = 0;
  virtual void visit_one_or_each(const Key& key, int count, bool all_equal,
                                 const ItemBody& item) = 0;

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
};

}  // namespace softarm
