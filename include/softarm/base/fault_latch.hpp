// A FAULT that nobody has acknowledged survives the process: it is kept in a file.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>
#include <thread>

namespace softarm {

/// Where a daemon keeps its state: the first that is set of $STATE_DIRECTORY (systemd),
/// $XDG_STATE_HOME/softarm, $HOME/.local/state/softarm; otherwise /var/tmp/softarm-UID.
std::filesystem::path state_directory();

/// One small file that is written by a separate thread, over bytes that the file has already: a
/// full disk does not matter. What cannot be understood counts as a FAULT.
class FaultLatch {
 public:
  /// Opens the file of `name`, or creates it. Throws nothing: see problem().
  FaultLatch(const std::filesystem::path& directory, const std::string& name);
  /// Writes what has not been written yet.
  ~FaultLatch();
  FaultLatch(const FaultLatch&) = delete;
  FaultLatch& operator=(const FaultLatch&) = delete;

  /// The FAULT that was found at the start, such as "emergency_stop"; empty if there was none.
  const std::string& found() const noexcept { return found_; }
  const std::filesystem::path& file() const noexcept { return file_; }
  /// Why nothing is kept; empty if it is.
  const std::string& problem() const noexcept { return problem_; }

  /// Has `reason` written, which must be in static storage. Neither waits nor allocates.
  void set(const char* reason) noexcept { want(reason); }
  /// Whether what was asked for last would survive this process: it is in the file, on its way to
  /// the disk. True as well where nothing can be kept. Neither waits nor allocates.
  bool kept() const noexcept { return !thread_.joinable() || kept_ == changes_; }
  /// Has the absence of a FAULT written; likewise.
  void clear() noexcept { want(""); }

 private:
  void open();
  void want(const char* reason) noexcept;
  void find_again() noexcept;
  bool write(const char* reason) noexcept;
  void write_until_end() noexcept;

  std::filesystem::path file_;
  std::string found_, problem_;
  int descriptor_ = -1;
  std::atomic<const char*> wanted_{""};
  std::atomic<int> changes_{0};
  std::atomic<int> kept_{0};  ///< changes up to which all is in the file
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace softarm
