// Interface behind a Modbus server: registers, and which of them may be read or written.
#pragma once

#include <cstdint>
#include <span>

namespace softarm {

/// 65536 holding registers, by address. Nothing throws.
class RegisterBank {
 public:
  virtual ~RegisterBank() = default;
  /// All registers.
  virtual std::span<std::uint16_t, 65536> registers() noexcept = 0;
  /// Whether `count` registers from `address` on may be read.
  virtual bool readable(int address, int count) const noexcept = 0;
  /// Whether they may be written.
  virtual bool writable(int address, int count) const noexcept = 0;
  /// Called after a request was served; `count` registers from `address` were written (0: read
  /// only).
  virtual void served(int address, int count) noexcept = 0;
};

}  // namespace softarm
