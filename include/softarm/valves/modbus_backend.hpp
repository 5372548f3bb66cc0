// A valve terminal on Modbus TCP as a back end: converts pressures to register words and back.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "softarm/valves/modbus_terminal.hpp"
#include "softarm/valves/valve_backend.hpp"

namespace softarm {

/// One block write a cycle and one block read, by the register map of the settings.
class ModbusBackend : public ValveBackend {
 public:
  /// @throws std::invalid_argument for a host that is not an IPv4 address
  ModbusBackend(const ValveDriverSettings& settings, double max_pressure_bar);

  bool connect() noexcept override;
  void close() noexcept override { terminal_.close(); }
  bool is_open() const noexcept override { return terminal_.is_open(); }
  Secured secure() noexcept override;
  Secured check() noexcept override;
  LinkResult write(const Eigen::VectorXd& set_points_bar) noexcept override;
  LinkResult read(ReadBack& read_back) noexcept override;
  const char* error() const noexcept override;
  /// "HOST:PORT unit ID"
  std::string address() const override;
  /// Warns that the registers were not tested on hardware, unless the terminal is on this machine.
  std::string warning() const override;

 private:
  /// Keeps why the time-out is not what was set.
  void refuse(const char* what) noexcept;

  ValveDriverSettings settings_;
  double max_pressure_bar_;
  ModbusTerminal terminal_;
  std::vector<std::uint16_t> out_, in_;
  std::array<std::uint16_t, 2> timeout_{};  ///< words of the fail-safe time-out
  std::array<char, 200> refusal_{};         ///< of the time-out; "": report the terminal's error
};

}  // namespace softarm
