// Counts every call of malloc of the whole program, those of operator new and of Eigen included.
// To be included in one file of a test program.
#pragma once

#include <atomic>
#include <cstddef>

namespace softarm::test {
inline std::atomic<long> allocations{0};
}

// With glibc's own name behind it. Sanitizers bring their own malloc; under them nothing is
// counted.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SOFTARM_COUNTS_MALLOC 1
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) noexcept {
  ++softarm::test::allocations;
  return __libc_malloc(size);
}
#else
#define SOFTARM_COUNTS_MALLOC 0
#endif
