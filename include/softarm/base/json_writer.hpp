// A small JSON writer: objects, arrays, 17 significant digits, null for what is not finite.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

namespace softarm {

/// Text builds up in order: open, key, value, close. Numbers survive a round trip; NaN and infinity
/// become null, which is all that JSON has for them.
class JsonWriter {
 public:
  void open_object() { open('{'); }
  void close_object() { close('}'); }
  void open_array() { open('['); }
  void close_array() { close(']'); }

  /// Name of the next value of the enclosing object.
  void key(std::string_view name) {
    separate();
    append_string(name);
    text_ += ": ";
    after_key_ = true;
  }

  void value(double number) {
    separate();
    if (std::isfinite(number)) {
      fmt::format_to(std::back_inserter(text_), "{:.17g}", number);
    } else {
      text_ += "null";
    }
  }
  void value(int number) { value(static_cast<std::int64_t>(number)); }
  void value(std::int64_t number) {
    separate();
    fmt::format_to(std::back_inserter(text_), "{}", number);
  }
  void value(bool truth) {
    separate();
    text_ += truth ? "true" : "false";
  }
  void value(std::string_view words) {
    separate();
    append_string(words);
  }
  void value(const char* words) { value(std::string_view(words)); }
  void null() {
    separate();
    text_ += "null";
  }

  template <class Value>
  void member(std::string_view name, const Value& content) {
    key(name);
    value(content);
  }

  const std::string& text() const { return text_; }

 private:
  void open(char bracket) {
    separate();
    text_ += bracket;
    first_.push_back(true);
  }
  void close(char bracket) {
    text_ += bracket;
    first_.pop_back();
  }
  void separate() {
    if (after_key_) {
      after_key_ = false;
    } else if (!first_.empty()) {
      if (!first_.back()) text_ += ", ";
      first_.back() = false;
    }
  }
  void append_string(std::string_view words) {
    text_ += '"';
    for (const char c : words) {
      if (c == '"' || c == '\\') {
        text_ += '\\';
        text_ += c;
      } else if (static_cast<unsigned char>(c) < 0x20) {
        fmt::format_to(std::back_inserter(text_), "\\u{:04x}", static_cast<unsigned>(c));
      } else {
        text_ += c;
      }
    }
    text_ += '"';
  }

  std::string text_;
  std::vector<bool> first_;  ///< per open bracket: nothing in it yet
  bool after_key_ = false;
};

}  // namespace softarm
