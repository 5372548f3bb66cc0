// A valve terminal's registers without its valves: what a driver writes and reads.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "softarm/valves/register_bank.hpp"
#include "softarm/valves/settings.hpp"

namespace softarm {

/// Behaves as the documents say, and as badly: a negative set point opens the valve wide. Set
/// points reset to zero when the driver has been silent for the time-out that it set (0, as after
/// power-up: never).
class SimulatedTerminal : public RegisterBank {
 public:
  SimulatedTerminal(const RegisterMap& map, std::vector<int> order);

  std::span<std::uint16_t, 65536> registers() noexcept override {
    return std::span<std::uint16_t, 65536>(registers_);
  }
  bool readable(int address, int count) const noexcept override;
  bool writable(int address, int count) const noexcept override;
  void served(int address, int count) noexcept override;

  /// True once for any number of requests served since.
  bool take_served() noexcept;
  /// Sensors: one pressure a chamber, then what the terminal tells of itself.
  void measure(const Eigen::VectorXd& actual_bar) noexcept;
  /// One set point a chamber as the valves take it (bar); slots that do not regulate give 0.
  const Eigen::VectorXd& set_points_bar() noexcept;
  /// As the driver set it; 0: never.
  double timeout_s() const noexcept;
  /// What its time-out does.
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
  bool served_ = false;
};

}  // namespace softarm
