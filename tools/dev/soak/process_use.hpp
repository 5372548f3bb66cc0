// What a process holds of the machine.
#pragma once

#include <cstdint>
#include <optional>

namespace softarm {

struct ProcessUse {
  std::int64_t resident_kib = 0;   ///< RSS
  std::int64_t anonymous_kib = 0;  ///< of it what is no file: heap and stacks, where leaks show
  int descriptors = 0;             ///< open ones
};

/// Of a running process; nothing if there is none of this number, or it has ended.
std::optional<ProcessUse> process_use(int pid);

}  // namespace softarm
