#include "softarm/config/network_search.hpp"

#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>

#include "config/yaml_tree.hpp"

namespace softarm {
namespace {

/// A hostile file must not keep anybody from stopping an arm.
struct Budget {
  int files = 16;
  std::size_t bytes = 1'000'000;
};

/// The value after "KEY:" in a line of YAML, or "".
std::string value_of(const std::string& key, const std::string& line) {
  const std::size_t at = line.find(key + ":");
  if (at == std::string::npos || (at > 0 && std::strchr(" {,", line[at - 1]) == nullptr)) return "";
  const std::size_t begin = line.find_first_not_of(" \"'", at + key.size() + 1);
  if (begin == std::string::npos) return "";
  return line.substr(begin, line.find_first_of(" \"',}", begin) - begin);
}

/// These keys occur nowhere else in an experiment.
void read(const std::filesystem::path& file, Budget& left, LcmSettings& lcm) {
  const std::pair<const char*, std::string*> keys[] = {{"url", &lcm.url},
                                                       {"operator_channel", &lcm.operator_channel},
                                                       {"status_channel", &lcm.status_channel}};
  std::error_code code;
  if (left.files-- <= 0 || !std::filesystem::is_regular_file(file, code)) return;
  std::ifstream stream(file);
  std::string all(left.bytes, '\0');
  stream.read(all.data(), static_cast<std::streamsize>(all.size()));
  all.resize(static_cast<std::size_t>(stream.gcount()));
  left.bytes -= all.size();
  std::istringstream text(all);
  for (std::string line; std::getline(text, line);) {
    line = line.substr(0, line.find('#'));
    std::string looked_for;
    if (const std::string other = value_of("include", line); !other.empty())
      read(included_file(file, other, looked_for), left, lcm);
    for (const auto& [key, setting] : keys)
      if (const std::string value = value_of(key, line); !value.empty()) *setting = value;
  }
}

}  // namespace

LcmSettings find_network(const std::filesystem::path& file) {
  LcmSettings lcm;
  Budget budget;
  read(file, budget, lcm);
  return lcm;
}

}  // namespace softarm
