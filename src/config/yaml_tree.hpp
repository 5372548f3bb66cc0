// A YAML file as a plain tree with the location of every node. Stricter than YAML: no tags, no
// duplicate keys, bounded depth and size, aliases copied within a bound; `include: FILE` at the top is merged in.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "softarm/base/output_file.hpp"
#include "softarm/config/config_keys.hpp"

namespace softarm {

struct YamlNode {
  enum class Kind { nothing, scalar, list, map };
  Kind kind = Kind::nothing;
  bool quoted = false;            ///< a scalar in quotes is text, never a number
  Location location;              ///< of the value
  Location key_location;          ///< of its key, where it has one, else of the value
  std::string text;               ///< of a scalar
  std::vector<std::string> keys;  ///< of a map, one an item
  std::vector<YamlNode> items;    ///< of a list or map

  /// The item at `key` of a map; nullptr where there is none.
  const YamlNode* find(std::string_view key) const;
  /// The content, for messages: `"0.11"`, `a list of 3`, `nothing`.
  std::string describe() const;
};

/// The file that `from` includes by this name: relative to the name of `from` or, where that is a
/// link, to the file itself; empty where there is none. @param looked_for  gets where it was sought
std::filesystem::path included_file(const std::filesystem::path& from, const std::string& name,
                                    std::string& looked_for);

/// Reads a file with everything it includes; values of the including file win, maps are merged key
/// by key. The root is a map. @param files  gets the name of every file read
/// @throws ConfigError, no other exception
YamlNode read_yaml_file(const std::filesystem::path& file, Files& files);

}  // namespace softarm
