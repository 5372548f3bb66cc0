// Modbus TCP client on libmodbus: every request ends in bounded time, whatever the terminal does.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "softarm/valves/settings.hpp"
#include "softarm/valves/valve_backend.hpp"

struct _modbus;

namespace softarm {

/// Belongs to one thread. A request lasts at most `response_timeout_s` (a long block: that for each
/// of its parts of 123 words written or 125 read).
class ModbusTerminal {
 public:
  /// Uses host, port, unit_id and the time-outs. @throws std::invalid_argument for a host that is
  /// not an IPv4 address
  explicit ModbusTerminal(const ValveDriverSettings& settings);
  ~ModbusTerminal();
  ModbusTerminal(const ModbusTerminal&) = delete;
  ModbusTerminal& operator=(const ModbusTerminal&) = delete;

  /// Connects within `connect_timeout_s`; false: see `error`.
  bool connect() noexcept;
  /// Closes the connection, if it is open.
  void close() noexcept;
  /// Whether `connect` succeeded and `close` was not called since.
  bool is_open() const noexcept { return open_; }

  /// Writes holding registers from `address` on.
  LinkResult write(int address, std::span<const std::uint16_t> words) noexcept;
  /// Reads holding registers from `address` on; `words` is unspecified unless ok.
  LinkResult read(int address, std::span<std::uint16_t> words) noexcept;

  /// Reason of the last failure.
  const char* error() const noexcept;

 private:
  LinkResult failed() noexcept;
  void set_response_timeout(double seconds) noexcept;

  _modbus* context_;
  double response_timeout_s_, connect_timeout_s_;
  bool open_ = false;
  int error_ = 0;
};

}  // namespace softarm
