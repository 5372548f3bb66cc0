// Lines from a loop that must not wait, printed by a thread that may.
#pragma once

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <string_view>
#include <thread>

namespace softarm {

/// One writer. Bounded: a line that does not fit is cut, lines that come faster than they can be
/// printed (10 a second for long) are counted.
class LineLog {
 public:
  /// @param print  called from the thread, one whole line at a time with its newline; must not
  /// throw
  LineLog(std::string_view program, std::function<void(const std::string&)> print)
      : program_(program),
        print_(std::move(print)),
        thread_([this](const std::stop_token& stop) { print_until(stop); }) {}

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
  static constexpr std::size_t kCapacity = 32;
  static constexpr std::chrono::milliseconds kPause{100};
  struct Line {
    std::array<char, 240> text;
    std::size_t length = 0;
  };

  void print_until(const std::stop_token& stop) {
    while (true) {
      const bool last = stop.stop_requested();
      // One line a pause, but all of them in the end.
      bool printed = false;
      for (std::size_t tail = tail_.load();
           tail != head_.load(std::memory_order_acquire) && (last || !printed);
           tail_.store(++tail)) {
        const Line& line = lines_[tail % kCapacity];
        print_(fmt::format("{}: {}\n", program_, std::string_view(line.text.data(), line.length)));
        printed = true;
      }
      if (const auto lost = lost_.exchange(0); lost > 0)
        print_(fmt::format("{}: {} lines came too fast to be printed\n", program_, lost));
      if (last) return;
      std::this_thread::sleep_for(kPause);
    }
  }

  std::string_view program_;
  std::function<void(const std::string&)> print_;
  std::array<Line, kCapacity> lines_{};
  std::atomic<std::size_t> head_{0}, tail_{0};
  std::atomic<std::int64_t> lost_{0};
  std::jthread thread_;
};

}  // namespace softarm
