// Random numbers that are the same bits with every standard library: its distributions are not
// specified, only its engines.
#pragma once

#include <array>
#include <cstdint>

namespace softarm {

/// xoshiro256++ seeded by splitmix64, with its own uniform and normal numbers.
class RandomNumbers {
 public:
  /// @param stream selects one of the independent sequences of a seed (noise, dropouts, ...).
  explicit RandomNumbers(std::uint64_t seed, std::uint64_t stream = 0) noexcept;

  std::uint64_t bits() noexcept;  ///< 64 uniform bits
  double uniform() noexcept;      ///< in [0, 1), 53 bits
  double normal() noexcept;       ///< standard normal, Box-Muller

 private:
  std::array<std::uint64_t, 4> state_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace softarm
