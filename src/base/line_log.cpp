#include "softarm/base/line_log.hpp"

#include <chrono>

namespace softarm {
namespace {

constexpr std::chrono::milliseconds kPause{100};

}  // namespace

LineLog::LineLog(std::string program, std::function<void(const std::string&)> print)
    : program_(std::move(program)),
      print_(std::move(print)),
      thread_([this](const std::stop_token& stop) { print_until(stop); }) {}

void LineLog::print_until(const std::stop_token& stop) {
  // Every pause permits one more line; unused permits accumulate.
  for (std::size_t allowed = kCapacity;; allowed = std::min(kCapacity, allowed + 1)) {
    const bool last = stop.stop_requested();
    for (std::size_t tail = tail_.load();
         tail != head_.load(std::memory_order_acquire) && (last || allowed > 0);
         tail_.store(++tail), allowed -= allowed > 0) {
      const Line& line = lines_[tail % kCapacity];
      print_(fmt::format("{}: {}\n", program_, std::string_view(line.text.data(), line.length)));
    }
    if (const auto lost = lost_.exchange(0); lost > 0)
      print_(fmt::format("{}: {} lines came too fast to be printed\n", program_, lost));
    if (last) return;
    std::this_thread::sleep_for(kPause);
  }
}

}  // namespace softarm
