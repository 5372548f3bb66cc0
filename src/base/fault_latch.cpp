#include "softarm/base/fault_latch.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <tuple>
#include <utility>

#include "softarm/base/hash.hpp"

namespace softarm {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBytes = 64;
constexpr std::string_view kClear = "no FAULT", kFault = "FAULT ";

std::string file_name(const std::string& name) {
  std::string safe = name.substr(0, 100);
  for (char& letter : safe)
    if (std::isalnum(static_cast<unsigned char>(letter)) == 0) letter = '_';
  return fmt::format("{}.{:016x}.fault", safe, fnv1a(name));
}

[[noreturn]] void fail(const char* what) {
  throw std::runtime_error(fmt::format("{}: {}", what, std::strerror(errno)));
}

/// Its descriptor, and whether it was created. Everybody may write to /var/tmp: what is there may be
/// a trap of somebody else. @throws std::runtime_error, fs::filesystem_error
std::pair<int, bool> open_safely(const fs::path& file) {
  const fs::path folder = file.parent_path();
  if (fs::create_directories(folder)) fs::permissions(folder, fs::perms::owner_all);
  struct stat about {};
  if (lstat(folder.c_str(), &about) != 0) fail("its folder");
  if (S_ISLNK(about.st_mode) && about.st_uid != geteuid() && about.st_uid != 0)
    throw std::runtime_error("its folder is somebody else's link");
  if (stat(folder.c_str(), &about) != 0) fail("its folder");
  if (about.st_uid != geteuid()) throw std::runtime_error("its folder belongs to somebody else");

  constexpr int kFlags = O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  int descriptor = ::open(file.c_str(), kFlags | O_CREAT | O_EXCL, 0600);
  const bool is_new = descriptor >= 0;
  if (!is_new) descriptor = ::open(file.c_str(), kFlags);
  if (descriptor < 0) fail("it cannot be opened");
  if (fstat(descriptor, &about) != 0 || !S_ISREG(about.st_mode)) {
    ::close(descriptor);
    throw std::runtime_error("it is not a file");
  }
  return {descriptor, is_new};
}

}  // namespace

fs::path state_directory() {
  const auto variable = [](const char* name) -> std::string {
    const char* value = std::getenv(name);
    return value != nullptr && value[0] == '/' ? value : "";
  };
  const std::string service = variable("STATE_DIRECTORY");
  if (!service.empty()) return service.substr(0, service.find(':'));
  if (const std::string state = variable("XDG_STATE_HOME"); !state.empty())
    return fs::path(state) / "softarm";
  if (const std::string home = variable("HOME"); !home.empty())
    return fs::path(home) / ".local/state/softarm";
  return fmt::format("/var/tmp/softarm-{}", geteuid());
}

FaultLatch::FaultLatch(const fs::path& directory, const std::string& name)
    : file_(directory / file_name(name)) {
  try {
    open();
    thread_ = std::thread([this] { write_until_end(); });
  } catch (const std::exception& error) {
    problem_ = error.what();
  }
}

FaultLatch::~FaultLatch() {
  if (thread_.joinable()) {
    ending_ = true;
    want(wanted_);
    thread_.join();
  }
  if (descriptor_ >= 0) ::close(descriptor_);
}

void FaultLatch::open() {
  bool is_new = false;
  std::tie(descriptor_, is_new) = open_safely(file_);
  if (!is_new) {
    std::array<char, kBytes + 1> bytes{};
    const ssize_t size = pread(descriptor_, bytes.data(), bytes.size(), 0);
    const std::string_view all(bytes.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
    std::string_view text = all.substr(0, all.find_last_not_of(" \n") + 1);
    if (all.size() != kBytes || (text != kClear && !text.starts_with(kFault))) {
      found_ = "unknown";
    } else if (text != kClear) {
      found_ = text.substr(kFault.size());
    }
  }
  // Takes the bytes, and shows that it can be written.
  static_assert(kClear.size() < kBytes);
  wanted_ = found_.c_str();
  if (!write(found_.c_str()) || fdatasync(descriptor_) != 0) {
    if (is_new) unlink(file_.c_str());
    fail("it cannot be written");
  }
}

void FaultLatch::want(const char* reason) noexcept {
  wanted_.store(reason);
  changes_.fetch_add(1);
  changes_.notify_one();
}

/// Folders for temporary files are cleared now and then: what is written to a file without a name
/// dies with this process.
void FaultLatch::find_again() noexcept {
  struct stat ours {
  }, named{};
  if (fstat(descriptor_, &ours) == 0 && lstat(file_.c_str(), &named) == 0 &&
      ours.st_dev == named.st_dev && ours.st_ino == named.st_ino)
    return;
  try {
    const int descriptor = open_safely(file_).first;
    ::close(std::exchange(descriptor_, descriptor));
  } catch (const std::exception&) {  // the old one is as good
  }
}

bool FaultLatch::write(const char* reason) noexcept {
  std::array<char, kBytes> bytes;
  bytes.fill(' ');
  bytes.back() = '\n';
  const auto put = [&](std::size_t at, std::string_view text) {
    std::memcpy(bytes.data() + at, text.data(), std::min(text.size(), kBytes - 1 - at));
  };
  if (reason[0] == '\0') {
    put(0, kClear);
  } else {
    put(0, kFault);
    put(kFault.size(), reason);
  }
  return pwrite(descriptor_, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(kBytes);
}

void FaultLatch::write_until_end() noexcept {
  const char* written = found_.c_str();  // set() may have been called already
  for (int seen = 0;;) {
    const bool last = ending_;
    const char* const wanted = wanted_;
    const bool differs = std::strcmp(wanted, written) != 0;
    if (differs) find_again();
    const bool put = differs && write(wanted);
    kept_ = seen;  // a process that is killed from here on has left it; or it cannot be kept
    if (put && fdatasync(descriptor_) == 0) written = wanted;
    if (last) return;
    changes_.wait(seen);
    seen = changes_;
  }
}

}  // namespace softarm
