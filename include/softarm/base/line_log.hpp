// Lines from a loop that must not wait, printed by a thread that may.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

namespace softarm {

/// For one writing thread. Bounded: a line that does not fit is cut, and lines that come faster
/// than they can be printed (kCapacity at once, 10 a second for long) are counted, not queued.
class LineLog {
 public:
  static constexpr std::size_t kCapacity = 64;
  static constexpr std::size_t kLongestLine = 240;

  /// @param program  begins every line: "program: line"
  /// @param print  called from the thread, one whole line at a time with its newline; must not
  /// throw
  LineLog(std::string program, std::function<void(const std::string&)> print);

  /// Prints what is still to be printed and ends the thread.
  void finish() { thread_ = {}; }

  /// Formats into a buffer that is there already: neither allocates nor waits.
  template <class... Arguments>
  void add(fmt::format_string<Arguments...> format, Arguments&&... arguments) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == kCapacity) {
      lost_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    Line& line = lines_[head % kCapacity];
    try {
      const auto end = fmt::format_to_n(line.text.data(), line.text.size(), format,
                                        std::forward<Arguments>(arguments)...);
      line.length = std::min(end.size, line.text.size());
    } catch (...) {  // a format that does not suit its arguments does not compile
      return;
    }
    head_.store(head + 1, std::memory_order_release);
  }

 private:
  struct Line {
    std::array<char, kLongestLine> text;
    std::size_t length = 0;
  };

  void print_until(const std::stop_token& stop);

  std::string program_;
  std::function<void(const std::string&)> print_;
  std::array<Line, kCapacity> lines_{};
  std::atomic<std::size_t> head_{0}, tail_{0};
  std::atomic<std::int64_t> lost_{0};
  std::jthread thread_;
};

}  // namespace softarm
