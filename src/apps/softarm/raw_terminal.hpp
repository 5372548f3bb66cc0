// Keys as they are pressed, without Enter and without echo.
#pragma once

#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <stdexcept>

namespace softarm {

/// Standard input as raw keys for as long as it lives; Ctrl-C still is a signal.
class RawTerminal {
 public:
  /// @throws std::runtime_error where standard input is no terminal
  RawTerminal() {
    if (tcgetattr(STDIN_FILENO, &before_) != 0)
      throw std::runtime_error("standard input is no terminal: keys cannot be held there");
    raw_ = before_;
    raw_.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    raw_.c_cc[VMIN] = 0;
    raw_.c_cc[VTIME] = 0;
    tcsetattr(STDIN_FILENO, TCSANOW, &raw_);
  }
  ~RawTerminal() { tcsetattr(STDIN_FILENO, TCSANOW, &before_); }
  RawTerminal(const RawTerminal&) = delete;
  RawTerminal& operator=(const RawTerminal&) = delete;

  /// Forgets the keys that wait. Raw again, too: a shell has its own ways with the terminal of a
  /// program that was stopped.
  void begin_anew() const { tcsetattr(STDIN_FILENO, TCSAFLUSH, &raw_); }

  /// What came since the last call: the newest key, 0 where none did, kGone where the terminal is
  /// gone.
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
