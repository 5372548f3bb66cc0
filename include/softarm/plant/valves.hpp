// The valve side of the arm: whose command is in force, and how pressures follow it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "softarm/plant/settings.hpp"

namespace softarm {

/// Proportional valves with a first-order lag between commanded and real pressure and a finite
/// supply.
///
/// While a command is held the pressure is known in closed form, p(t) = c + (p(0) - c) exp(-t /
/// lag): stepping is exact for any step, and an integrator may ask for the pressure at any time
/// ahead. Lag 0 is the ideal valve. A slew limit, if any, first lets the pressure rise (or fall) on
/// a straight line until the lag alone is slower; a resolution rounds what is commanded. Dead time
/// is not theirs: see ArmPlant.
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

  /// Whether a slew limit is in force: then pressures are not exponentials of time.
  bool slewed() const noexcept { return slew_bar_per_s_ > 0.0; }

  /// exp(-ahead / lag): what is left after `ahead_s` of the difference between pressure and command
  /// (0 with lag 0).
  double remaining(double ahead_s) const noexcept;

  const Eigen::VectorXd& pressures_bar() const noexcept { return pressure_bar_; }  ///< real, now
  const Eigen::VectorXd& commanded_bar() const noexcept {
    return command_bar_;
  }  ///< within the supply

 private:
  double lag_s_;
  double supply_bar_;
  double lowest_bar_;
  double slew_bar_per_s_;
  double resolution_bar_;
  Eigen::VectorXd pressure_bar_;
  Eigen::VectorXd command_bar_;
};

/// What the valve side makes of a command.
enum class CommandVerdict {
  in_force,   ///< its set points hold until a newer command comes or it expires
  older,      ///< its sequence number is not above that of the command in force
  shadow,     ///< computed for inspection, not for the valves
  malformed,  ///< wrong number of pressures, a pressure that is not finite, or no validity
};

/// Set points for every valve, as a controller sends them.
struct PressureCommand {
  std::int64_t sequence = 0;     ///< counts up by one a command
  std::int64_t validity_ns = 0;  ///< how long it may be held after its arrival
  bool shadow = false;
  std::span<const double>
      pressure_bar;  ///< above ambient; segment by segment, in each the configured chamber order
};

/// Decides which command is in force, so that the arm vents by itself when its controller falls
/// silent: no clock of its own, time comes in as an argument.
///
/// Before the first command and from the expiry of the last one on, every set point is 0 bar. After
/// an expiry a sender may start its sequence numbers anew. Nothing allocates or throws after
/// construction.
class CommandExpiry {
 public:
  static constexpr std::int64_t kNoSequence = -1;  ///< `sequence()` while vented
  static constexpr std::int64_t kNever = INT64_MAX;

  /// @param chambers number of set points in a command, >= 0 (std::invalid_argument otherwise).
  explicit CommandExpiry(int chambers);

  /// Takes a command that arrived at `arrival_ns` (times never go back).
  CommandVerdict receive(const PressureCommand& command, std::int64_t arrival_ns) noexcept;

  /// Lets a command expire whose validity ended at or before `now_ns`. Returns true if that vented
  /// the valves just now.
  bool update(std::int64_t now_ns) noexcept;

  bool vented() const noexcept { return expires_ns_ == kNever; }    ///< no command is in force
  std::int64_t expires_ns() const noexcept { return expires_ns_; }  ///< kNever while vented
  std::int64_t sequence() const noexcept { return sequence_; }      ///< of the command in force
  const Eigen::VectorXd& set_points_bar() const noexcept {
    return set_points_bar_;
  }  ///< zero while vented

 private:
  std::int64_t expires_ns_ = kNever;
  std::int64_t sequence_ = kNoSequence;
  Eigen::VectorXd set_points_bar_;
};

}  // namespace softarm
