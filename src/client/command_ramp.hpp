// Which set points are sent next, and when: limits, ramp and expiry, with time as an argument.
#pragma once

#include <cstdint>
#include <softarm_messages/pressure_command_t.hpp>

#include "softarm/actuation/pressure_ramps.hpp"
#include "softarm/base/time.hpp"
#include "softarm/transport/arm_messages.hpp"
#include "softarm/transport/sent_commands.hpp"

namespace softarm {

/// Set points of the program that commands an arm, 100 times a second or more often where their
/// validity requires it. Times are ns of one monotonic clock.
class CommandRamp {
 public:
  CommandRamp(const ActuationSettings& actuation, double validity_s);

  /// Moves every set point towards `wanted_bar`, within the pressure limits and at most at the slew
  /// rate or `rate_bar_per_s`, for the time since the last call, but never for more than a period.
  void approach(const PressureVector& wanted_bar, double rate_bar_per_s, std::int64_t now_ns);
  /// The same towards 0 bar, at the vent rate.
  void vent(std::int64_t now_ns);

  bool due(std::int64_t now_ns) const { return now_ns >= next_ns_; }
  /// The valves have vented: set points begin at zero again.
  void interrupt();
  /// The command to send at `now_ns`. If the one before it has expired, the valves have vented.
  const softarm_messages::pressure_command_t& next(std::int64_t now_ns);

  const PressureVector& set_points_bar() const { return bar_; }
  std::int64_t sent_ns() const { return sent_ns_; }
  std::int64_t next_ns() const { return next_ns_; }
  /// Whether some command was sent after the one before it had expired.
  bool held_up() const { return held_up_; }
  /// Whether this is one of the latest commands that `next` returned.
  bool is_ours(const ChamberCommand& command) const {
    return sent_.contains(command.sequence, command.time_us);
  }

 private:
  double step_s(std::int64_t now_ns);

  ActuationSettings actuation_;
  PressureRamps vent_ramps_;
  PressureVector bar_;
  std::int64_t period_ns_, updated_ns_ = 0, next_ns_ = 0, sent_ns_ = kNever;
  bool held_up_ = false;
  softarm_messages::pressure_command_t message_;
  SentCommands sent_;
};

}  // namespace softarm
