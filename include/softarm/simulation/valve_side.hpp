// The valve side of a simulated arm that takes its commands over the network, without a terminal.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "softarm/actuation/command_expiry.hpp"
#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/base/time.hpp"

namespace softarm {

/// What ValveGuard does with commands, for torques too: they expire, no sender is trusted to keep
/// the slew limit, and two senders vent until one has left for 0.25 s and commands have been zero,
/// or silent. Time is an argument (ns of a clock
/// that never goes back). Never throws or allocates after construction.
class ValveSide {
 public:
  ValveSide(const ActuationSettings& actuation, std::int64_t longest_validity_ns);

  /// Takes a command by the rules of CommandExpiry.
  CommandVerdict receive(const PressureCommand& command, std::int64_t now_ns) noexcept;
  /// Lets time pass.
  void update(std::int64_t now_ns) noexcept;
  /// The clock stood still: whatever was in force has expired.
  void pause() noexcept;

  /// bar (N m with actuation by torque), one a chamber; zero while vented.
  const Eigen::VectorXd& set_points() const noexcept { return set_points_; }
  /// No command is in force, or none may be.
  bool vented() const noexcept { return !in_force_; }
  /// Whether it is vented because two programs command.
  bool degraded(std::int64_t now_ns) const noexcept {
    return must_see_zero_ || now_ns < degraded_until_ns_;
  }
  /// Of the command in force; CommandExpiry::kNoSequence while vented.
  std::int64_t sequence() const noexcept {
    return vented() ? CommandExpiry::kNoSequence : expiry_.sequence();
  }
  /// How often set points fell to zero by itself.
  std::int64_t times_vented() const noexcept { return times_vented_; }
  /// When set points change next without a command.
  std::int64_t next_event_ns() const noexcept;
  /// The commands taken.
  const CommandExpiry& commands() const noexcept { return expiry_; }

 private:
  void vent() noexcept;

  CommandExpiry expiry_;
  double slew_per_s_;
  Eigen::VectorXd set_points_;
  bool in_force_ = false;
  bool reached_ = true;  ///< set points are those commanded
  bool must_see_zero_ = false;
  std::int64_t degraded_until_ns_ = kNever;
  std::int64_t heard_ns_ = kNever;
  std::int64_t updated_ns_ = kNever;
  std::int64_t times_vented_ = 0;
};

}  // namespace softarm
