#include "softarm/config/network_search.hpp"

#include <cstring>
#include <fstream>
#include <string>
#include <utility>

namespace softarm {
namespace {

constexpr int kMostIncludes = 8;  ///< nested

/// The value after "KEY:" in a line of YAML, or "".
std::string value_of(const std::string& key, const std::string& line) {
  const std::size_t at = line.find(key + ":");
  if (at == std::string::npos || (at > 0 && std::strchr(" {,", line[at - 1]) == nullptr)) return "";
  const std::size_t begin = line.find_first_not_of(" \"'", at + key.size() + 1);
  if (begin == std::string::npos) return "";
  return line.substr(begin, line.find_first_of(" \"',}", begin) - begin);
}

/// These keys occur nowhere else in an experiment.
void read(const std::filesystem::path& file, int includes_left, LcmSettings& lcm) {
  const std::pair<const char*, std::string*> keys[] = {{"url", &lcm.url},
                                                       {"operator_channel", &lcm.operator_channel},
                                                       {"status_channel", &lcm.status_channel}};
  std::ifstream text(file);
  for (std::string line; std::getline(text, line);) {
    line = line.substr(0, line.find('#'));
    if (const std::string other = value_of("include", line); !other.empty() && includes_left > 0)
      read(file.parent_path() / other, includes_left - 1, lcm);
    for (const auto& [key, setting] : keys)
      if (const std::string value = value_of(key, line); !value.empty()) *setting = value;
  }
}

}  // namespace

LcmSettings find_network(const std::filesystem::path& file) {
  LcmSettings lcm;
  read(file, kMostIncludes, lcm);
  return lcm;
}

}  // namespace softarm
