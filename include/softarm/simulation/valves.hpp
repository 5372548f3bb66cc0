// The valves of the simulated arm: how pressures follow what is commanded.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "softarm/actuation/fill_vent_lag.hpp"
#include "softarm/simulation/settings.hpp"

namespace softarm {

/// Proportional valves with a first-order lag between commanded and real pressure and a finite
/// supply.
///
/// While a command is held the pressure is known in closed form, p(t) = c + (p(0) - c) exp(-t /
/// lag): stepping is exact for any step, and an integrator may ask for the pressure at any time
/// ahead. Lag 0 is the ideal valve; a chamber may vent with another lag than it fills. A slew
/// limit, if any, first lets the pressure rise (or fall) on a straight line until the lag alone is
/// slower; a resolution rounds what is commanded; play (backlash) and a dead band lie between that
/// and what the valve aims at. Dead time is not theirs: see ArmPlant.
///
/// A supply that sags, S = supply - sag times the sum of all p' > 0, is held from one call of
/// `command`, `advance` or `reset` to the next, so that all this stays in closed form: short steps
/// follow it (first order). A chamber that S cannot fill keeps its pressure (check valve).
class Valves {
 public:
  /// @param chambers number of valves, >= 0. All start at 0 bar with 0 bar commanded.
  /// @param both_signs for actuation by torque: commands are bounded to [-supply, supply].
  /// @throw std::invalid_argument for a negative count, a lag that is negative or not finite, a
  /// supply below 0.
  Valves(const ValveSettings& settings, int chambers, bool both_signs = false);

  int size() const noexcept { return static_cast<int>(pressure_bar_.size()); }

  /// Sets what is commanded from now on, bounded to [0, supply]; a value that is not a number
  /// counts as 0 bar. With lag 0 the pressures follow at once. @param command_bar `size()`
  /// pressures above ambient.
  void command(std::span<const double> command_bar) noexcept;

  /// Lets `step_s` >= 0 pass with the command held (exact).
  void advance(double step_s) noexcept;

  /// Puts the real pressures where they are said to be (bar, bounded to [0, supply]), the command
  /// too.
  void reset(std::span<const double> pressure_bar) noexcept;

  /// What the pressures will be `ahead_s` >= 0 from now if the command is held; `out` has `size()`.
  void after(double ahead_s, Eigen::Ref<Eigen::VectorXd> out) const noexcept;

  /// Whether all pressures are the same exponential of time, as they are without a slew limit and
  /// with one lag.
  bool exponential() const noexcept {
    return slew_bar_per_s_ == 0.0 && lag_.vent_s == lag_.fill_s && !sags();
  }
  bool sags() const noexcept { return sag_s_ > 0.0; }
  /// Of the common supply, with all that flows now, bar.
  double supply_bar() const noexcept { return sagged_bar_; }

  const Eigen::VectorXd& pressures_bar() const noexcept { return pressure_bar_; }  ///< real, now
  /// What the valves aim at, within the supply.
  const Eigen::VectorXd& commanded_bar() const noexcept { return command_bar_; }

 private:
  /// What a chamber's pressure goes to from where it is, and how fast it rises there, with a supply
  /// of `supply_bar`.
  double aim_bar(Eigen::Index i, double supply_bar) const noexcept;
  double rise_bar_per_s(Eigen::Index i, double supply_bar) const noexcept;
  void meet_supply() noexcept;

  FillVentLag lag_;
  double supply_bar_;
  double lowest_bar_;
  double slew_bar_per_s_;
  double resolution_bar_, play_bar_, dead_band_bar_;
  double sag_s_;
  double sagged_bar_;
  Eigen::VectorXd pressure_bar_;
  Eigen::VectorXd command_bar_;
};

}  // namespace softarm
