// Detects whether a key is held: a terminal only reports that it repeats.
#pragma once

#include <cstdint>

#include "softarm/base/time.hpp"

namespace softarm {

/// Held from the first event until the repeats end. Keyboards repeat after 0.25 to 0.7 s for the
/// first time and then 10 to 30 times a second, so the first wait is longer.
class KeyHold {
 public:
  static constexpr std::int64_t kFirst_ns = 750'000'000;
  static constexpr std::int64_t kNext_ns = 250'000'000;

  void event(std::int64_t now_ns) noexcept {
    repeats_ = held(now_ns);
    last_ns_ = now_ns;
  }
  bool held(std::int64_t now_ns) const noexcept {
    return last_ns_ != kNever && now_ns - last_ns_ <= (repeats_ ? kNext_ns : kFirst_ns);
  }

 private:
  std::int64_t last_ns_ = kNever;
  bool repeats_ = false;
};

}  // namespace softarm
