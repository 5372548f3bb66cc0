// A text that is a number.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace softarm {

/// All of the text as a T; nothing where it is something else or out of range.
template <typename T>
std::optional<double> parsed(std::string_view text) {
  T value{};
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || text.empty()) return {};
  return static_cast<double>(value);
}

}  // namespace softarm
