// What the writer of a file probably meant: the end of a message.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "softarm/base/form.hpp"

namespace softarm {

/// All of a text as a number: digits with a decimal point, an exponent, or one over another (1/120);
/// without zeros in front, which are octal to some programs.
std::optional<double> plain_number(std::string_view text);

/// The key among `known` (full paths without indices) that `path` probably stands for; empty: none.
/// Those of the same section come before others; none of `taken`.
std::string nearest_key(const std::string& path, const std::set<std::string>& known,
                        const std::set<std::string>& taken);

/// "did you mean X?", or another fix of a scalar that is not of this form; empty where none is
/// known. @param unit  of the key
std::string likely_fix(const std::string& text, bool quoted, const Form& form,
                       std::string_view unit);

/// A fault of a text that is no YAML, where people would look for it.
struct TextFault {
  int line;
  std::string key, expected, got;
};
std::optional<TextFault> find_text_fault(const std::string& text);

/// Whether all of a text is UTF-8.
bool is_utf8(std::string_view text);

}  // namespace softarm
