// Lines of text over a serial device, for back ends of boards with a text protocol.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "softarm/valves/valve_backend.hpp"

namespace softarm {

/// 8 data bits, no parity, 1 stop bit, no flow control. Belongs to one thread; after construction
/// nothing allocates or throws, and every call returns within `timeout_s`.
class SerialLine {
 public:
  static constexpr std::size_t kLongest = 8192;  ///< bytes of a line, with its end

  /// @param baud one of the standard rates from 9600 to 921600 @throws std::invalid_argument
  SerialLine(std::string device, int baud, double timeout_s);
  ~SerialLine() { close(); }
  SerialLine(const SerialLine&) = delete;
  SerialLine& operator=(const SerialLine&) = delete;

  /// Opens the device. False: see `error`.
  bool open() noexcept;
  /// Closes the device. Data still queued is sent first, as far as the time-out allows.
  void close() noexcept;
  /// Whether the device is open.
  bool is_open() const noexcept { return file_ >= 0; }

  /// Sends `text` and a newline. Input received before is discarded: a late answer would be taken
  /// for the answer to this line.
  LinkResult send(std::string_view text) noexcept;
  /// Receives the next line, without its line end; valid until the next call. A line longer than
  /// kLongest counts as no answer.
  LinkResult receive(std::string_view& text) noexcept;

  /// Reason of the last failure; after a line was received: that it was not understood.
  const char* error() const noexcept;
  /// Path of the device.
  const std::string& device() const noexcept { return device_; }

 private:
  LinkResult ended(LinkResult result, int error) noexcept;

  std::string device_;
  unsigned speed_;  ///< termios constant of the baud rate
  long timeout_ns_;
  int file_ = -1;
  int error_ = 0;
  std::array<char, kLongest> received_;
  std::size_t size_ = 0;
  std::size_t taken_ = 0;  ///< bytes of `received_` consumed by the previous line
};

}  // namespace softarm
