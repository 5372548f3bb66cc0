// Writes little-endian numbers and texts to the end of a packet.
#pragma once

#include <bit>
#include <cstddef>
#include <cstring>
#include <string_view>
#include <vector>

namespace softarm {

class ByteWriter {
 public:
  explicit ByteWriter(std::vector<std::byte>& out) : out_(out) {}

  template <class Number>
  void put(Number number) {
    out_.resize(out_.size() + sizeof number);
    put_at(out_.size() - sizeof number, number);
  }
  template <class Number>
  void put_at(std::size_t at, Number number) {
    static_assert(std::endian::native == std::endian::little);
    std::memcpy(out_.data() + at, &number, sizeof number);
  }
  /// Characters and a zero.
  void put_text(std::string_view text) {
    const auto* const from = reinterpret_cast<const std::byte*>(text.data());
    out_.insert(out_.end(), from, from + text.size());
    out_.push_back(std::byte{0});
  }

 private:
  std::vector<std::byte>& out_;
};

}  // namespace softarm
