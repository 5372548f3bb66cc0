// Which commands on a channel are our own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace softarm {

/// Remembers the commands sent last, to recognise them when they are received: LCM delivers to a
/// program what it sends itself. No allocation.
class SentCommands {
 public:
  void add(std::int64_t sequence, std::int64_t time_us) noexcept {
    sent_[place(sequence)] = {sequence, time_us};
  }
  /// Whether it is one of the last 1024.
  bool contains(std::int64_t sequence, std::int64_t time_us) const noexcept {
    const Sent& sent = sent_[place(sequence)];
    return sequence > 0 && sent.sequence == sequence && sent.time_us == time_us;
  }

 private:
  struct Sent {
    std::int64_t sequence = 0, time_us = 0;
  };
  static constexpr std::size_t kKept = 1024;
  static std::size_t place(std::int64_t sequence) noexcept {
    return static_cast<std::size_t>(sequence) % kKept;
  }

  std::array<Sent, kKept> sent_{};
};

}  // namespace softarm
