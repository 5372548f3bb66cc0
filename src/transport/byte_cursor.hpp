// Reads numbers and texts out of a packet that may hold anything.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

namespace softarm {

/// Walks over bytes in an order. Once something did not fit, all that follows is zero and `ok`
/// false.
template <std::endian kOrder>
class ByteCursor {
 public:
  explicit ByteCursor(std::span<const std::byte> bytes) : left_(bytes) {}

  bool ok() const { return ok_; }
  bool at_end() const { return ok_ && left_.empty(); }
  std::size_t left() const { return left_.size(); }

  void fail() {
    ok_ = false;
    left_ = {};
  }

  /// The next `size` bytes; none where fewer are left.
  std::span<const std::byte> take_bytes(std::size_t size) {
    if (size > left_.size()) {
      fail();
      return {};
    }
    const auto taken = left_.first(size);
    left_ = left_.subspan(size);
    return taken;
  }
  void skip(std::size_t size) { take_bytes(size); }

  template <class Number>
  Number take() {
    using Bits = std::conditional_t<
        sizeof(Number) == 8, std::uint64_t,
        std::conditional_t<sizeof(Number) == 4, std::uint32_t,
                           std::conditional_t<sizeof(Number) == 2, std::uint16_t, std::uint8_t>>>;
    const auto from = take_bytes(sizeof(Number));
    Bits bits = 0;
    for (std::size_t k = 0; k < from.size(); ++k) {
      const std::size_t at = kOrder == std::endian::big ? k : from.size() - 1 - k;
      bits = static_cast<Bits>(static_cast<std::uint64_t>(bits) << 8 |
                               std::to_integer<std::uint64_t>(from[at]));
    }
    return std::bit_cast<Number>(bits);
  }

  /// A number of elements of at least `element` bytes each: no more than can still come.
  std::size_t count(std::size_t element) {
    const auto size = take<std::int32_t>();
    if (size < 0 || static_cast<std::size_t>(size) > left_.size() / element) fail();
    return ok_ ? static_cast<std::size_t>(size) : 0;
  }

  void skip_list(std::size_t element) { skip(element * count(element)); }

  /// Characters up to a zero, which is skipped.
  std::string_view take_text() {
    const auto zero = std::find(left_.begin(), left_.end(), std::byte{0});
    if (zero == left_.end()) {
      fail();
      return {};
    }
    const auto taken = take_bytes(static_cast<std::size_t>(zero - left_.begin()) + 1);
    return {reinterpret_cast<const char*>(taken.data()), taken.size() - 1};
  }

 private:
  std::span<const std::byte> left_;
  bool ok_ = true;
};

using BigEndianCursor = ByteCursor<std::endian::big>;  // LCM
using LittleEndianCursor = ByteCursor<std::endian::little>;

}  // namespace softarm
