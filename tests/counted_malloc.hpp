// Counts every call for memory of the whole program, those of operator new and of Eigen included,
// and every release of it by the calling thread. Weak, so that several files of a test program may
// include this.
#pragma once

#include <atomic>
#include <cstddef>

namespace softarm::test {
inline std::atomic<long> allocations{0};
/// Of the calling thread alone, for programs whose libraries have their own threads.
inline thread_local long thread_allocations = 0;
inline thread_local long thread_releases = 0;
inline void count_allocation() noexcept {
  ++allocations;
  ++thread_allocations;
}
}  // namespace softarm::test

// With glibc's own names behind them. Sanitizers bring their own malloc; under them nothing is
// counted.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SOFTARM_COUNTS_MALLOC 1
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* __libc_calloc(std::size_t count, std::size_t size);
extern "C" void* __libc_realloc(void* memory, std::size_t size);
extern "C" void* __libc_memalign(std::size_t alignment, std::size_t size);
extern "C" void __libc_free(void* memory);
extern "C" [[gnu::weak]] void* malloc(std::size_t size) noexcept {
  softarm::test::count_allocation();
  return __libc_malloc(size);
}
extern "C" [[gnu::weak]] void* calloc(std::size_t count, std::size_t size) noexcept {
  softarm::test::count_allocation();
  return __libc_calloc(count, size);
}
extern "C" [[gnu::weak]] void* realloc(void* memory, std::size_t size) noexcept {
  softarm::test::count_allocation();
  return __libc_realloc(memory, size);
}
extern "C" [[gnu::weak]] void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  softarm::test::count_allocation();
  return __libc_memalign(alignment, size);
}
extern "C" [[gnu::weak]] void free(void* memory) noexcept {
  if (memory != nullptr) ++softarm::test::thread_releases;
  __libc_free(memory);
}
#else
#define SOFTARM_COUNTS_MALLOC 0
#endif
