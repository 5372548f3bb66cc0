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

}  // namespace

ConfigError::ConfigError(std::string file_name, int line_number, std::string key_path,
                         std::string expected_text, std::string got_text)
    : std::runtime_error(message(file_name, line_number, key_path, expected_text, got_text)),
      file(std::move(file_name)),
      line(line_number),
      key(std::move(key_path)),
      expected(std::move(expected_text)),
      got(std::move(got_text)) {}

}  // namespace softarm
