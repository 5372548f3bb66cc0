// Keys as they are pressed, without Enter and without echo.
#pragma once

#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <stdexcept>

namespace softarm {

/// Standard input as raw keys during its lifetime; Ctrl-C remains a signal.
class RawTerminal {
 public:
  /// @throws std::runtime_error where standard input is not a terminal
  RawTerminal() {
    if (tcgetattr(STDIN_FILENO, &before_) != 0)
      throw std::runtime_error(
          "standard input is not a terminal: expected one, whose keys can be held");
    raw_ = before_;
    raw_.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    raw_.c_cc[VMIN] = 0;
    raw_.c_cc[VTIME] = 0;
    tcsetattr(STDIN_FILENO, TCSANOW, &raw_);
  }
  ~RawTerminal() { tcsetattr(STDIN_FILENO, TCSANOW, &before_); }
  RawTerminal(const RawTerminal&) = delete;
  RawTerminal& operator=(const RawTerminal&) = delete;

  /// Discards pending keys and sets raw mode again: a shell resets the terminal of a program that
  /// was stopped.
  void restart() const { tcsetattr(STDIN_FILENO, TCSAFLUSH, &raw_); }

  /// The newest key since the last call, 0 if there was none, kGone if the terminal is gone.
  static constexpr int kGone = -1;
  int key() const {
    pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
    int newest = 0;
    while (poll(&input, 1, 0) > 0) {
      unsigned char byte = 0;
      if (read(STDIN_FILENO, &byte, 1) <= 0) return kGone;
      newest = byte;
    }
    return newest;
  }

 private:
  termios before_{}, raw_{};
};

}  // namespace softarm
