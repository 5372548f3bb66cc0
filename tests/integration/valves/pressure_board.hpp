// A pressure board at the other end of a pseudo-terminal: its valves follow at once, and it does
// what a test asks for.
#pragma once

#include <poll.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <atomic>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace softarm::test {

class PressureBoard {
 public:
  enum class Answer { good, none, noise, flood, one_too_few, not_a_number };

  PressureBoard() {
    termios raw{};
    cfmakeraw(&raw);
    char name[64];
    if (openpty(&board_, &line_, name, &raw, nullptr) != 0)
      throw std::runtime_error("no pseudo-terminal");
    device_ = name;
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~PressureBoard() { unplug(); }
  PressureBoard(const PressureBoard&) = delete;
  PressureBoard& operator=(const PressureBoard&) = delete;

  const std::string& device() const { return device_; }
  /// As if the plug were pulled: for good.
  void unplug() {
    if (!thread_.joinable()) return;
    thread_.request_stop();
    thread_.join();
    close(board_);
    close(line_);
  }

  std::atomic<Answer> answer{Answer::good};
  std::atomic<bool> takes_timeout{true};

  int timeout_ms() const { return timeout_ms_; }
  int lines() const { return lines_; }  ///< of set points
  std::vector<double> set_points_bar() const {
    const std::lock_guard lock(mutex_);
    return set_points_bar_;
  }
  double highest_ever_bar() const { return highest_ever_bar_; }

 private:
  void run(const std::stop_token& stop) {
    std::string received;
    while (!stop.stop_requested()) {
      pollfd descriptor{.fd = board_, .events = POLLIN, .revents = 0};
      if (poll(&descriptor, 1, 5) <= 0) continue;
      char bytes[512];
      const ssize_t count = read(board_, bytes, sizeof bytes);
      if (count <= 0) continue;
      received.append(bytes, static_cast<std::size_t>(count));
      for (std::size_t end; (end = received.find('\n')) != std::string::npos;) {
        take(received.substr(0, end));
        received.erase(0, end + 1);
      }
    }
  }
  void say(const std::string& text) const {
    if (write(board_, text.data(), text.size()) < 0) return;
  }
  void take(const std::string& line) {
    std::istringstream words(line);
    std::string what;
    words >> what;
    if (what == "W") {
      int timeout_ms = 0;
      words >> timeout_ms;
      timeout_ms_ = takes_timeout ? timeout_ms : 0;
      say("W " + std::to_string(timeout_ms_) + "\n");
    } else if (what == "S") {
      std::vector<double> bar;
      for (double each; words >> each;) {
        bar.push_back(each);
        if (each > highest_ever_bar_) highest_ever_bar_ = each;
      }
      {
        const std::lock_guard lock(mutex_);
        set_points_bar_ = bar;
      }
      ++lines_;
      report(bar);
    }
  }
  void report(const std::vector<double>& bar) const {
    std::string text = "P";
    for (const double each : bar) text += " " + std::to_string(each);
    switch (answer) {
      case Answer::good:
        return say(text + "\r\n");
      case Answer::none:
        return;
      case Answer::noise:
        return say("\x7f\xff@#P 0.1\n\n");
      case Answer::flood:
        return say(std::string(20000, 'P'));
      case Answer::one_too_few:
        return say(text.substr(0, text.rfind(' ')) + "\n");
      case Answer::not_a_number:
        return say(text.substr(0, text.rfind(' ')) + " nan\n");
    }
  }

  int board_ = -1, line_ = -1;
  std::string device_;
  std::atomic<int> timeout_ms_{-1}, lines_{0};
  std::atomic<double> highest_ever_bar_{0.0};
  mutable std::mutex mutex_;
  std::vector<double> set_points_bar_;
  std::jthread thread_;
};

}  // namespace softarm::test
