// A folder for files that nobody keeps, and a network for processes that nobody else hears.
#pragma once

#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <string>
#include <system_error>

namespace softarm {

/// A folder that goes with the object.
class TemporaryFolder {
 public:
  /// @throws std::system_error where none can be made
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "softarm_XXXXXX").string();
    const char* made = mkdtemp(pattern.data());
    if (made == nullptr) throw std::system_error(errno, std::generic_category(), pattern);
    path_ = made;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// An LCM URL of this machine, with a port for this process alone.
inline std::string own_network() {
  return fmt::format("udpm://239.255.76.67:{}?ttl=0", 20000 + getpid() % 12000);
}

}  // namespace softarm
