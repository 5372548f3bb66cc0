// Is the clock that stamps frames coarser than the frames?
#pragma once

#include <algorithm>

namespace softarm {

/// Counts how often a stamp repeats that of the frame before: each repetition weighs as much as
/// four frames with a new stamp, and sixteen make a clock coarse (15.6 ms grain, or standing still).
class CoarseClock {
 public:
  void count(bool repeats) noexcept { weight_ = std::clamp(weight_ + (repeats ? 4 : -1), 0, 64); }
  bool coarse() const noexcept { return weight_ >= 16; }

 private:
  int weight_ = 0;
};

}  // namespace softarm
