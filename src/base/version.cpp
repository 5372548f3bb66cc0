#include "softarm/base/version.hpp"

#include <fmt/format.h>
#include <gnu/libc-version.h>
#include <softarm_commit.h>

namespace softarm {

const char* version_text() noexcept { return SOFTARM_VERSION; }
const char* commit_text() noexcept { return SOFTARM_COMMIT; }

std::string build_text() {
  std::string compiled = "x86-64", machine;
#ifdef __AVX2__
  compiled += " avx2";
#endif
#ifdef __FMA__
  compiled += " fma";
#endif
#ifdef __AVX512F__
  compiled += " avx512f";
#endif
#ifndef __OPTIMIZE__
  compiled += " not optimised";
#endif
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2") != 0) machine += " avx2";
  if (__builtin_cpu_supports("fma") != 0) machine += " fma";
  if (__builtin_cpu_supports("avx512f") != 0) machine += " avx512f";
#endif
  return fmt::format("softarm {} commit {}; compiler {} for {}; machine{}; glibc {}",
                     version_text(), commit_text(), __VERSION__, compiled, machine,
                     gnu_get_libc_version());
}

}  // namespace softarm
