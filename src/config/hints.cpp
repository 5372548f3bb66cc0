#include "config/hints.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <vector>

#include "config/parsed_number.hpp"

namespace softarm {
namespace {

/// Insertions, deletions, replacements and swaps of neighbours that turn one into the other.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> cost(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) cost[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) cost[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i)
    for (std::size_t j = 1; j <= b.size(); ++j) {
      cost[i][j] = std::min({cost[i - 1][j] + 1, cost[i][j - 1] + 1,
                             cost[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        cost[i][j] = std::min(cost[i][j], cost[i - 2][j - 2] + 1);
    }
  return cost[a.size()][b.size()];
}

std::string normalized(std::string_view name) {
  std::string out;
  for (const char c : name)
    out +=
        c == '-' || c == ' ' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

std::string_view stem(std::string_view name) {
  const auto cut = name.rfind('_');
  return cut == std::string_view::npos ? name : name.substr(0, cut);
}

/// Whether all words of the shorter name are in the longer one, in their order.
bool words_of(std::string_view shorter, std::string_view longer) {
  const auto next = [](std::string_view& rest) {
    const std::size_t end = std::min(rest.find('_'), rest.size());
    const std::string_view word = rest.substr(0, end);
    rest.remove_prefix(std::min(rest.size(), end + 1));
    return word;
  };
  int words = 0;
  while (!shorter.empty()) {
    const std::string_view word = next(shorter);
    ++words;
    while (true) {
      if (longer.empty()) return false;
      if (next(longer) == word) break;
    }
  }
  return words > 1;
}

/// How far apart two names are; infinite where nobody would mistake one for the other.
double name_cost(std::string_view written, std::string_view known) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  constexpr std::size_t kLongestKey = 64;
  if (written.empty() || written.size() > kLongestKey) return kFar;
  const std::string a = normalized(written), b = normalized(known);
  if (a == b) return 0.0;
  const std::string &shorter = a.size() < b.size() ? a : b, &longer = a.size() < b.size() ? b : a;
  // Without its unit, or only the beginning of the words.
  if (longer.starts_with(shorter) && (longer[shorter.size()] == '_' || shorter.size() >= 4))
    return 0.5 + 0.01 * static_cast<double>(longer.size() - shorter.size());
  if (longer.ends_with("_" + shorter) && shorter.size() >= 4) return 0.9;
  if (stem(a) == stem(b) && stem(a).size() >= 3) return 1.0;  // another unit
  const auto distance = static_cast<double>(edit_distance(a, b));
  const auto most = static_cast<double>(std::max<std::size_t>(1, longer.size() / 4));
  if (distance <= most) return distance;
  if (words_of(shorter, longer)) return 1.5;
  if (edit_distance(stem(a), stem(b)) <= 1 && stem(b).size() >= 5) return 2.0;
  return kFar;
}

std::string_view last_name(std::string_view path) {
  const auto cut = path.rfind('.');
  return cut == std::string_view::npos ? path : path.substr(cut + 1);
}

std::string_view section_of(std::string_view path) {
  const auto cut = path.rfind('.');
  return cut == std::string_view::npos ? std::string_view() : path.substr(0, cut);
}

bool zeros_in_front(std::string_view text) {
  if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
  return text.size() > 1 && text[0] == '0' &&
         std::isdigit(static_cast<unsigned char>(text[1])) != 0;
}

/// "0.15" of "-00.15".
std::string_view without_zeros(std::string_view text) {
  while (!text.empty() && (text[0] == '-' || text[0] == '+')) text.remove_prefix(1);
  while (text.size() > 1 && text[0] == '0' &&
         std::isdigit(static_cast<unsigned char>(text[1])) != 0)
    text.remove_prefix(1);
  return text;
}

std::string replaced(std::string text, std::string_view any_of, std::string_view by) {
  std::string out;
  for (const char c : text) any_of.find(c) == std::string_view::npos ? out += c : out += by;
  return out;
}

/// Another unit in which people give what is counted in `unit`.
struct OtherUnit {
  std::string_view unit, name;
  double factor;
};
constexpr std::array kOtherUnits =
    std::to_array<OtherUnit>({{"m", "mm", 1e-3},
                              {"m", "cm", 1e-2},
                              {"kg", "g", 1e-3},
                              {"s", "ms", 1e-3},
                              {"bar", "kPa", 1e-2},
                              {"bar", "Pa", 1e-5},
                              {"bar", "psi", 0.0689476},
                              {"bar", "mbar", 1e-3},
                              {"Hz", "kHz", 1e3},
                              {"rad", "degrees", 0.017453292519943295},
                              {"rad", "degree", 0.017453292519943295},
                              {"rad", "deg", 0.017453292519943295},
                              {"rad", "\xc2\xb0", 0.017453292519943295}});

/// "0.15 kg", "110 mm", "90 deg".
std::string unit_fix(std::string_view text, std::string_view unit) {
  double value = 0.0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end == text.data() + text.size()) return {};
  std::string_view rest = text.substr(static_cast<std::size_t>(end - text.data()));
  while (rest.starts_with(' ')) rest.remove_prefix(1);
  if (rest.empty() || std::isdigit(static_cast<unsigned char>(rest[0])) != 0) return {};
  for (const OtherUnit& other : kOtherUnits) {
    if (other.unit != unit || rest != other.name) continue;
    if (unit == "rad") return fmt::format("write it in rad: {}*pi/180", value);
    return fmt::format("write it in {}: {:.6g}", unit, value * other.factor);
  }
  if (rest.find_first_of("0123456789*/,") != std::string_view::npos) return {};
  return fmt::format("write the number alone: {}", text.substr(0, text.size() - rest.size()));
}

/// Of a number that is out of range: in another unit it would not be.
std::string range_fix(double value, const Form& form, std::string_view unit) {
  for (const OtherUnit& other : kOtherUnits) {
    const double converted = value * other.factor;
    if (other.unit != unit || std::abs(other.factor) >= 1.0 || !form.contains(converted)) continue;
    if (std::abs(value) <= std::abs(form.high)) continue;
    if (unit == "rad") return fmt::format("degrees? write {}*pi/180", value);
    return fmt::format("in {}? then it is {:.6g} {}", other.name, converted, unit);
  }
  return {};
}

/// "0.11, 0.12" and "(0.11, 0.12)": several numbers, but no list.
std::string list_fix(std::string text) {
  if (text.starts_with('(') && text.ends_with(')')) text = text.substr(1, text.size() - 2);
  if (text.find(", ") == std::string::npos) return {};
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(", ", at), text.size());
    if (!plain_number(text.substr(at, end - at))) return {};
    at = end + 2;
  }
  return "in brackets: [" + text + "]";
}

std::string number_fix(const std::string& text, bool quoted, const Form& form,
                       std::string_view unit) {
  const auto number = [](const std::string& t) { return plain_number(t).has_value(); };
  if (quoted && number(text)) return "write it without quotes";
  if (zeros_in_front(text))
    return fmt::format("zeros in front make it octal to some programs: write {}{}",
                       text.starts_with('-') ? "-" : "", without_zeros(text));
  if (const auto value = plain_number(text)) {
    if (form.whole && *value != std::round(*value)) return {};
    if (form.whole && form.contains(*value)) return fmt::format("write {}", *value);
    return range_fix(*value, form, unit);
  }
  if (const std::string list = list_fix(text); !form.sizes.empty() && !list.empty()) return list;
  if (text.find(',') != std::string::npos) {
    const std::string point = replaced(text, ",", ".");
    if (number(point)) return "with a decimal point: " + point;
    const std::string none = replaced(text, ",", "");
    if (number(none)) return "without separators: " + none;
  }
  for (const char* separators : {"_", " ", "'"})
    if (const std::string joined = replaced(text, separators, ""); number(joined))
      return "without separators: " + joined;
  if (text.starts_with("0x")) return "write it in decimal digits";
  if (const std::string fix = unit_fix(text, unit); !fix.empty()) return fix;
  if (const auto at = text.find("pi"); at != std::string::npos && unit == "rad")
    return at > 0 && std::isdigit(static_cast<unsigned char>(text[at - 1])) != 0
               ? "write " + text.substr(0, at) + "*" + text.substr(at)
               : "multiples of pi are written 2*pi/3";
  if (text.find_first_of("*+(^") != std::string::npos && text.find_first_of("0123456789") == 0)
    return "a file has no arithmetic but one number over another: write the result";
  return {};
}

std::string word_fix(const std::string& text, const Form& form) {
  const std::string lower = normalized(text);
  if (form.is_flag()) {
    for (const char* word : {"yes", "on", "1", "y", "true", "enabled"})
      if (lower == word) return "write true";
    for (const char* word : {"no", "off", "0", "n", "false", "disabled"})
      if (lower == word) return "write false";
    return {};
  }
  const Form::Word* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const Form::Word& word : form.words)
    if (const double cost = name_cost(text, word.text); cost < least) {
      least = cost;
      best = &word;
    }
  return best == nullptr ? std::string() : fmt::format("did you mean {}?", best->text);
}

}  // namespace

std::optional<double> plain_number(std::string_view text) {
  if (const auto slash = text.find('/'); slash != std::string_view::npos) {
    const std::string_view below = text.substr(slash + 1);
    const auto dividend = plain_number(text.substr(0, slash));
    const auto divisor =
        below.find('/') == std::string_view::npos ? plain_number(below) : std::nullopt;
    if (!dividend || !divisor || !(*divisor > 0.0)) return {};
    return *dividend / *divisor;
  }
  if (zeros_in_front(text)) return {};
  return parsed<double>(text.substr(text.starts_with('+') && !text.starts_with("+-") ? 1 : 0));
}

std::string nearest_key(const std::string& path, const std::set<std::string>& known,
                        const std::set<std::string>& taken) {
  constexpr double kElsewhere = 1.0;
  std::string best;
  double least = std::numeric_limits<double>::infinity();
  const std::string_view name = last_name(path);
  for (const std::string& candidate : known) {
    if (taken.contains(candidate)) continue;
    const bool here = section_of(candidate) == section_of(path);
    double cost = name_cost(name, last_name(candidate));
    if (!here && cost > 0.0 && (name.size() < 5 || last_name(candidate).size() < 5)) continue;
    if (!here) cost += kElsewhere;
    if (cost < least) {
      least = cost;
      best = candidate;
    }
  }
  return best;
}

std::string likely_fix(const std::string& text, bool quoted, const Form& form,
                       std::string_view unit) {
  std::string fix;
  if (form.numeric) fix = number_fix(text, quoted, form, unit);
  if (fix.empty() && !form.words.empty()) fix = word_fix(text, form);
  return fix;
}

bool is_utf8(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const auto first = static_cast<unsigned char>(text[at++]);
    if (first < 0x80) continue;
    const int more = first >= 0xf0 && first < 0xf5 ? 3 : first >= 0xe0 ? 2 : first >= 0xc2 ? 1 : 0;
    if (more == 0 || first >= 0xf5) return false;
    for (int k = 0; k < more; ++k, ++at)
      if (at >= text.size() || (static_cast<unsigned char>(text[at]) & 0xc0) != 0x80) return false;
  }
  return true;
}

}  // namespace softarm
