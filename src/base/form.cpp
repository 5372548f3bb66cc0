#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "softarm/base/keys.hpp"

namespace softarm {
namespace {

/// Of two suffixes that match, the first counts.
constexpr std::array kUnits = std::to_array<std::pair<std::string_view, std::string_view>>({
    {"_nm_per_rad_s", "N m/(rad s)"},
    {"_n_per_m_s", "N/(m s)"},
    {"_nm_per_rad3", "N m/rad^3"},
    {"_nm_per_rad", "N m/rad"},
    {"_nms_per_rad", "N m s/rad"},
    {"_nm_per_bar", "N m/bar"},
    {"_nm_per_s", "N m/s"},
    {"_ns_per_m", "N s/m"},
    {"_n_per_m", "N/m"},
    {"_bar_per_s", "bar/s"},
    {"_m_per_bar", "m/bar"},
    {"_1pbar", "1/bar"},
    {"_per_bar", "1/bar"},
    {"_per_sqrt_s", "1/s^0.5"},
    {"_radps", "rad/s"},
    {"_mps2", "m/s^2"},
    {"_mps", "m/s"},
    {"_radps2", "rad/s^2"},
    {"_1ps", "1/s"},
    {"_bar", "bar"},
    {"_rad", "rad"},
    {"_kg", "kg"},
    {"_hz", "Hz"},
    {"_nm", "N m"},
    {"_n", "N"},
    {"_m", "m"},
    {"_s", "s"},
    {"absolute_tolerance", "rad"},  // the one name without its unit
});

std::string range_text(const Form& form) {
  constexpr double kUnbounded = std::numeric_limits<double>::max();
  if (form.low == -kUnbounded && form.high == kUnbounded) return "";
  const auto bound = [](double value) -> std::string {
    if (std::abs(value) == 2.0 * std::numbers::pi) return value < 0.0 ? "-2*pi" : "2*pi";
    return fmt::format("{}", value);
  };
  return fmt::format(" in {}{}, {}]", form.above_low ? "(" : "[", bound(form.low),
                     bound(form.high));
}

std::string numbers_text(const Form& form, bool counted) {
  const std::string_view number = form.whole ? "whole number" : "number";
  if (form.sizes.empty()) return fmt::format("a {}", number);
  const int size = counted || !form.sized_by_keys ? form.sizes.front() : Form::kAny;
  const std::string many = size == Form::kAny ? "" : fmt::format(" of {}", size);
  const bool nested = form.sizes.size() == 2;
  if (nested && !form.one_for_all) return fmt::format("{0} rows of {0} numbers", size);
  if (nested)
    return fmt::format("a number or a list{} numbers or pairs", many.empty() ? " of" : many);
  if (form.one_for_all) return fmt::format("a {} or a list{}", number, many);
  return fmt::format("a list{} {}s", many.empty() ? " of" : many, number);
}

}  // namespace

Form from(double low, double high) { return {.low = low, .high = high}; }

Form above(double low, double high) { return {.low = low, .high = high, .above_low = true}; }

Form one_of(std::span<const char* const> names) {
  Form form{.numeric = false};
  for (const char* name : names) {
    form.words.push_back({name, {static_cast<double>(form.words.size())}});
  }
  return form;
}

Form one_of(std::initializer_list<const char*> names) {
  return one_of(std::span(names.begin(), names.size()));
}

Form base_rotation() {
  return from(-1, 1)
      .or_word("hanging", {1, 0, 0, 0, -1, 0, 0, 0, -1})
      .or_word("standing", {1, 0, 0, 0, 1, 0, 0, 0, 1});
}

Form Form::sized(const std::vector<int>& outermost_first, bool by_keys, bool one) const {
  Form form = *this;
  form.sizes = outermost_first;
  form.sized_by_keys = by_keys;
  form.one_for_all = one;
  return form;
}

Form Form::or_word(const char* word, const std::vector<double>& numbers) const {
  Form form = *this;
  form.words.push_back({word, numbers});
  return form;
}

const Form::Word* Form::find(const std::vector<double>& numbers) const {
  const auto at = std::find_if(words.begin(), words.end(),
                               [&](const Word& word) { return word.numbers == numbers; });
  return at == words.end() ? nullptr : &*at;
}

const Form::Word* Form::find(std::string_view text) const {
  const auto at =
      std::find_if(words.begin(), words.end(), [&](const Word& word) { return word.text == text; });
  return at == words.end() ? nullptr : &*at;
}

std::string Form::text(std::string_view unit, bool counted) const {
  if (is_flag()) return "true or false";
  std::vector<std::string_view> names;
  for (const Word& word : words) names.push_back(word.text);
  if (!numeric) return fmt::format("one of {}", fmt::join(names, ", "));
  return fmt::format("{}{}{}{}{}{}", fmt::join(names, ", "), words.empty() ? "" : " or ",
                     numbers_text(*this, counted), range_text(*this), unit.empty() ? "" : " ",
                     unit);
}

std::string_view Key::unit() const {
  const std::string_view text = name;
  const auto at = std::find_if(kUnits.begin(), kUnits.end(),
                               [&](const auto& unit) { return text.ends_with(unit.first); });
  return at == kUnits.end() ? "" : at->second;
}

}  // namespace softarm
