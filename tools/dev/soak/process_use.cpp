#include "dev/soak/process_use.hpp"

#include <filesystem>
#include <fstream>
#include <string>

namespace softarm {

std::optional<ProcessUse> process_use(int pid) {
  const std::filesystem::path folder = "/proc/" + std::to_string(pid);
  std::ifstream status(folder / "status");
  ProcessUse use;
  bool found = false;
  for (std::string word; status >> word;) {
    if (word == "VmRSS:") status >> use.resident_kib;
    if (word == "RssAnon:") found = static_cast<bool>(status >> use.anonymous_kib);
  }
  std::error_code gone;
  for (std::filesystem::directory_iterator each(folder / "fd", gone), end; !gone && each != end;
       each.increment(gone))
    ++use.descriptors;
  if (!found || gone) return std::nullopt;
  return use;
}

}  // namespace softarm
