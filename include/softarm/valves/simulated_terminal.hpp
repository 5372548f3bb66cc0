// The registers of a valve terminal, without valves: what a driver writes and reads.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "softarm/valves/register_bank.hpp"
#include "softarm/valves/settings.hpp"

namespace softarm {

/// Behaves as documented, including the hazards: a negative set point fully opens the valve. Set
/// points reset to zero when nothing is written within the time-out set by the driver (0, as after
/// power-up: never); clients that only read do not keep them.
class SimulatedTerminal : public RegisterBank {
 public:
  /// `order`: the valve of every chamber, from 0.
  SimulatedTerminal(const RegisterMap& map, std::vector<int> order);

  std::span<std::uint16_t, 65536> registers() noexcept override {
    return std::span<std::uint16_t, 65536>(registers_);
  }
  bool readable(int address, int count) const noexcept override;
  bool writable(int address, int count) const noexcept override;
  void served(int address, int count) noexcept override;

  /// Whether anything was written since the last call.
  bool take_written() noexcept;
  /// Sets the sensors: one pressure per chamber (bar), then the status that the terminal reports.
  void measure(const Eigen::VectorXd& actual_bar) noexcept;
  /// Set points as the valves take them (bar, one per chamber); slots that do not regulate give 0.
  const Eigen::VectorXd& set_points_bar() noexcept;
  /// Time-out as set by the driver; 0: never.
  double timeout_s() const noexcept;
  /// Effect of the time-out: resets the set points.
  void reset_outputs() noexcept;

 private:
  static constexpr double kWideOpen_bar = 1000.0;
  std::uint16_t& word(int address) noexcept {
    return registers_[static_cast<std::size_t>(address)];
  }

  RegisterMap map_;
  std::vector<int> order_;
  std::vector<std::uint16_t> registers_;
  Eigen::VectorXd set_points_bar_;
  bool written_ = false;
};

}  // namespace softarm
