// Where a text that is no YAML is wrong, as people see it: a parser notices most faults a line later.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <sstream>
#include <vector>

#include "config/hints.hpp"

namespace softarm {
namespace {

bool in_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// One line without its comment, and where its key is in the file.
class Line {
 public:
  explicit Line(const std::string& text) : text_(text.substr(0, comment(text))) {
    if (!text_.empty() && text_.back() == '\r') text_.pop_back();
    while (!text_.empty() && text_.back() == ' ') text_.pop_back();
    indent_ = std::min(text_.find_first_not_of(" \t"), text_.size());
    begin_ = indent_;
    while (text_.compare(begin_, 2, "- ") == 0) begin_ = text_.find_first_not_of(' ', begin_ + 1);
    std::size_t end = begin_;
    while (end < text_.size() && in_word(text_[end])) ++end;
    word_ = text_.substr(begin_, end - begin_);
    rest_ = text_.substr(end);
  }

  bool blank() const { return indent_ == text_.size(); }
  bool tab() const { return text_.substr(0, indent_).find('\t') != std::string::npos; }
  std::size_t column() const { return begin_; }
  const std::string& word() const { return word_; }
  const std::string& rest() const { return rest_; }
  bool is_item() const { return begin_ > indent_; }
  bool is_key() const { return !word_.empty() && (rest_ == ":" || rest_.starts_with(": ")); }
  std::string value() const { return rest_.size() > 2 ? rest_.substr(2) : ""; }

  /// Brackets that are opened and not closed, outside quotes; `quote` is one that stays open.
  int brackets(char& quote) const {
    int open = 0;
    for (const char c : text_.substr(begin_)) {
      if (quote != 0) {
        if (c == quote) quote = 0;
      } else if (c == '"') {
        quote = c;
      } else {
        open += c == '[' || c == '{' ? 1 : c == ']' || c == '}' ? -1 : 0;
      }
    }
    return open;
  }

 private:
  static std::size_t comment(const std::string& text) {
    if (text.starts_with('#')) return 0;
    return std::min(text.find(" #"), text.size());
  }

  std::string text_, word_, rest_;
  std::size_t indent_ = 0, begin_ = 0;
};

/// Reads line by line and stops at the first fault.
class Reader {
 public:
  std::optional<TextFault> take(const Line& line) {
    ++number_;
    if (line.blank()) return std::nullopt;
    if (line.tab()) return fault("spaces to indent: YAML takes no tabs", "a tab");
    if (open_ > 0 && line.is_key()) {
      number_ = opened_;
      return TextFault{opened_, path(), "a closing bracket", "an opening one alone"};
    }
    if (open_ == 0) {
      if (const auto found = judge(line)) return found;
    }
    char quote = 0;
    const int before = open_;
    open_ += line.brackets(quote);
    if (quote != 0) return fault("a closing quote", "an opening one alone");
    if (open_ < 0) return fault("an opening bracket", "a closing one alone");
    if (before == 0 && open_ > 0) opened_ = number_;
    return std::nullopt;
  }

  std::optional<TextFault> end() {
    if (open_ <= 0) return std::nullopt;
    return TextFault{opened_, path(), "a closing bracket", "an opening one alone"};
  }

 private:
  struct Section {
    std::size_t column;
    std::string name;
    bool has_value;
  };

  TextFault fault(const std::string& expected, const std::string& got) const {
    return {number_, path(), expected, got};
  }
  std::string path() const {
    std::string path;
    for (const Section& each : sections_) path += (path.empty() ? "" : ".") + each.name;
    return path;
  }

  std::optional<TextFault> judge(const Line& line) {
    const std::string &word = line.word(), &rest = line.rest();
    if (word.empty() || (line.is_item() && !line.is_key())) return std::nullopt;
    bool dedented = false;
    while (!sections_.empty() && sections_.back().column > line.column()) {
      sections_.pop_back();
      dedented = true;
    }
    const bool deeper = sections_.empty() || sections_.back().column < line.column();
    const bool under_value = deeper && !sections_.empty() && sections_.back().has_value;
    if (!deeper) sections_.pop_back();
    sections_.push_back({line.column(), word, !line.value().empty()});
    if (rest.empty() || rest[0] == ' ') {
      const auto sign = rest.find_first_not_of(' ');
      const bool equals = sign != std::string::npos && (rest[sign] == '=' || rest[sign] == ':');
      if (equals && rest[sign] == ':') return std::nullopt;  // "key : value"
      return fault(fmt::format("a colon behind the key ({}: ...)", word),
                   equals ? "an equals sign" : "none");
    }
    if (rest[0] == '=')
      return fault(fmt::format("a colon behind the key ({}: ...)", word), "an equals sign");
    if (rest[0] == ':' && rest.size() > 1 && rest[1] != ' ')
      return fault(fmt::format("a space behind the colon ({}: ...)", word), "none");
    if (line.is_key() && ((dedented && deeper) || under_value))
      return fault("keys of one section to begin in the same column",
                   fmt::format("column {}", line.column() + 1));
    return std::nullopt;
  }

  int number_ = 0;
  int open_ = 0, opened_ = 0;  ///< brackets, and the line of the first
  std::vector<Section> sections_;
};

}  // namespace

std::optional<TextFault> find_text_fault(const std::string& text) {
  std::istringstream stream(text);
  Reader reader;
  for (std::string line; std::getline(stream, line);)
    if (const auto fault = reader.take(Line(line))) return fault;
  return reader.end();
}

}  // namespace softarm
