// The error of a configuration and its location: the only exception thrown by reading one.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace softarm {

/// A faulty configuration. what() is "file:line: key: expected X, got Y".
class ConfigError : public std::runtime_error {
 public:
  std::string file;  ///< as the user named it
  int line = 0;      ///< 1-based; 0: no line (the file cannot be read)
  std::string
      key;  ///< full dotted path, e.g. "arm.segments[1].length_m"; empty: the file as a whole
  std::string expected;  ///< with unit and range
  std::string got;

  /// Composes what() of its parts.
  ConfigError(std::string file_name, int line_number, std::string key_path,
              std::string expected_text, std::string got_text);

 protected:
  ConfigError(const ConfigError& first, const std::string& message);
};

/// All that is wrong with a configuration: the members are those of the first error, what() has a
/// line for each.
class ConfigErrors : public ConfigError {
 public:
  static constexpr std::size_t kMost = 20;  ///< in what()

  /// @param errors  at least one
  explicit ConfigErrors(const std::vector<ConfigError>& errors);
};

}  // namespace softarm
