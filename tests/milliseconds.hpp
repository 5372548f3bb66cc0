// A unit of time for tests.
#pragma once

#include <cstdint>

namespace softarm::test {

inline constexpr std::int64_t kMs = 1'000'000;  ///< a millisecond in nanoseconds

}  // namespace softarm::test
