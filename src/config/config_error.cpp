#include "softarm/config/config_error.hpp"

#include <fmt/format.h>

#include <utility>

namespace softarm {
namespace {

std::string message(const std::string& file, int line, const std::string& key,
                    const std::string& expected, const std::string& got) {
  const std::string place = line > 0 ? fmt::format("{}:{}", file, line) : file;
  const std::string what = key.empty() ? "" : fmt::format("{}: ", key);
  return fmt::format("{}: {}expected {}, got {}", place, what, expected, got);
}

std::string message(const std::vector<ConfigError>& errors) {
  std::string text;
  for (std::size_t i = 0; i < errors.size() && i < ConfigErrors::kMost; ++i)
    text += fmt::format("{}{}", i == 0 ? "" : "\n", errors[i].what());
  if (errors.size() > ConfigErrors::kMost)
    text +=
        fmt::format("\n{}: and {} more", errors.front().file, errors.size() - ConfigErrors::kMost);
  return text;
}

}  // namespace

ConfigError::ConfigError(std::string file_name, int line_number, std::string key_path,
                         std::string expected_text, std::string got_text)
    : std::runtime_error(message(file_name, line_number, key_path, expected_text, got_text)),
      file(std::move(file_name)),
      line(line_number),
      key(std::move(key_path)),
      expected(std::move(expected_text)),
      got(std::move(got_text)) {}

ConfigError::ConfigError(const ConfigError& first, const std::string& text)
    : std::runtime_error(text),
      file(first.file),
      line(first.line),
      key(first.key),
      expected(first.expected),
      got(first.got) {}

ConfigErrors::ConfigErrors(const std::vector<ConfigError>& errors)
    : ConfigError(errors.front(), message(errors)) {}

}  // namespace softarm
