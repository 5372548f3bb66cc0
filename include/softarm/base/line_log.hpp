// Log lines of a loop that must not block, printed by a thread that may.
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

/// A bounded log for one writing thread. A line that does not fit is cut, and lines that come
/// faster than they can be printed (kCapacity at once, 10 per second sustained) are counted, not
/// queued.
class LineLog {
 public:
  /// Lines that may wait to be printed.
  static constexpr std::size_t kCapacity = 64;
  /// Characters kept of a line.
  static constexpr std::size_t kLongestLine = 240;

  /// @param program  prefix of every line: "program: line"
  /// @param print  called from the printing thread with one whole line at a time, newline included;
  /// must not throw
  LineLog(std::string program, std::function<void(const std::string&)> print);

  /// Prints the waiting lines and ends the thread.
  void finish() { thread_ = {}; }

  /// Formats a line into a preallocated buffer: neither allocates nor waits.
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
