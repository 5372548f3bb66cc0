// The clocks, and the disk, of a process started with `preload` (wall_clock.cpp), which a test or a soak sets.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

namespace softarm {

class PreloadedClocks {
 public:
  explicit PreloadedClocks(const std::string& path) : path_(path) {
    const int file = open(path.c_str(), O_RDWR | O_CREAT, 0600);
    if (file < 0 || ftruncate(file, kSize) != 0) return;
    void* const mapped = mmap(nullptr, kSize, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (mapped != MAP_FAILED) shared_ = static_cast<std::atomic<std::int64_t>*>(mapped);
  }
  ~PreloadedClocks() {
    if (shared_ != nullptr) munmap(shared_, kSize);
  }
  PreloadedClocks(const PreloadedClocks&) = delete;
  PreloadedClocks& operator=(const PreloadedClocks&) = delete;

  bool made() const { return shared_ != nullptr; }
  /// Arguments of `env` before the program.
  std::vector<std::string> preload() const {
    return {"LD_PRELOAD=" SOFTARM_WALL_CLOCK, "SOFTARM_WALL_CLOCK=" + path_};
  }
  /// The wall clock is set to so many seconds after the real one.
  void set_offset_s(std::int64_t offset_s) { shared_[0] = offset_s; }
  /// How often the wall clock was read.
  std::int64_t reads() const { return shared_[1]; }
  /// The machine was suspended: CLOCK_MONOTONIC stood still for so long.
  void suspend(std::int64_t ns) { shared_[2] += ns; }
  /// The machine was paused, and neither clock counted it.
  void lose(std::int64_t ns) { shared_[3] += ns; }
  /// From now on its disk takes so long to write at a position of a file.
  void slow_disk(std::int64_t ns) { shared_[4] = ns; }

 private:
  static constexpr std::size_t kSize = 5 * sizeof(std::int64_t);

  std::string path_;
  std::atomic<std::int64_t>* shared_ = nullptr;
};

}  // namespace softarm
