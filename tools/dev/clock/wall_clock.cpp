// A library to be loaded before all others (LD_PRELOAD): while a program runs, its wall clock is
// set, its machine seems to have been suspended, or paused without any clock counting it, its disk
// is slow; for that program alone.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace {

struct Shared {
  std::atomic<std::int64_t> offset_s;      ///< written by the test
  std::atomic<std::int64_t> reads;         ///< of the wall clock, written here
  std::atomic<std::int64_t> suspended_ns;  ///< CLOCK_BOOTTIME is ahead by so much
  std::atomic<std::int64_t> lost_ns;  ///< CLOCK_MONOTONIC and CLOCK_BOOTTIME are behind by so much
  std::atomic<std::int64_t> disk_ns;  ///< a write at a position takes so long
};

/// The file that SOFTARM_WALL_CLOCK names, five 64-bit integers.
Shared* shared() {
  static Shared* const memory = [] {
    const char* path = std::getenv("SOFTARM_WALL_CLOCK");
    const int file = path != nullptr ? open(path, O_RDWR) : -1;
    if (file < 0) std::abort();
    void* const mapped = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (mapped == MAP_FAILED) std::abort();
    return static_cast<Shared*>(mapped);
  }();
  return memory;
}

std::int64_t offset_s() {
  shared()->reads.fetch_add(1);
  return shared()->offset_s.load();
}

void add(timespec& time, std::int64_t ns) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t sum = time.tv_sec * kSecond + time.tv_nsec + ns;
  time = {.tv_sec = sum / kSecond, .tv_nsec = sum % kSecond};
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const auto result = static_cast<int>(syscall(SYS_clock_gettime, clock, time));
  if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
    time->tv_sec += offset_s();
  if (result == 0 && clock == CLOCK_BOOTTIME)
    add(*time, shared()->suspended_ns.load() - shared()->lost_ns.load());
  if (result == 0 && clock == CLOCK_MONOTONIC) add(*time, -shared()->lost_ns.load());
  return result;
}

extern "C" int gettimeofday(timeval* time, void* zone) noexcept {
  const auto result = static_cast<int>(syscall(SYS_gettimeofday, time, zone));
  if (result == 0) time->tv_sec += offset_s();
  return result;
}

extern "C" time_t time(time_t* out) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (out != nullptr) *out = now.tv_sec;
  return now.tv_sec;
}

extern "C" ssize_t pwrite(int file, const void* bytes, size_t size, off_t at) {
  timespec delay{};
  add(delay, shared()->disk_ns.load());
  nanosleep(&delay, nullptr);
  return syscall(SYS_pwrite64, file, bytes, size, at);
}
extern "C" ssize_t pwrite64(int file, const void* bytes, size_t size, off64_t at) {
  return pwrite(file, bytes, size, at);
}

// The kernel stamps packets with its wall clock as they come in: SO_TIMESTAMP, which LCM asks for.
extern "C" ssize_t recvmsg(int socket, msghdr* message, int flags) {
  const ssize_t result = syscall(SYS_recvmsg, socket, message, flags);
  if (result < 0) return result;
  for (cmsghdr* part = CMSG_FIRSTHDR(message); part != nullptr; part = CMSG_NXTHDR(message, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_TIMESTAMP) continue;
    timeval stamp{};
    std::memcpy(&stamp, CMSG_DATA(part), sizeof stamp);
    stamp.tv_sec += offset_s();
    std::memcpy(CMSG_DATA(part), &stamp, sizeof stamp);
  }
  return result;
}
