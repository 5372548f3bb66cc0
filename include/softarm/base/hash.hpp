// A hash that is the same on every machine and in every version.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace softarm {

/// FNV-1a hash of 64 bits.
inline std::uint64_t fnv1a(std::span<const std::byte> bytes) noexcept {
  std::uint64_t hash = 14695981039346656037ull;
  for (const std::byte each : bytes)
    hash = (hash ^ std::to_integer<std::uint64_t>(each)) * 1099511628211ull;
  return hash;
}
/// The same of the bytes of a text.
inline std::uint64_t fnv1a(std::string_view text) noexcept {
  return fnv1a(std::as_bytes(std::span(text)));
}

}  // namespace softarm
