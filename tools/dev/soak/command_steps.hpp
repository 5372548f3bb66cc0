// How far commands move the valves: what a watcher judges the slew by.
#pragma once

#include <algorithm>
#include <cstdint>

#include "softarm/actuation/command_expiry.hpp"
#include "softarm/transport/arm_messages.hpp"

namespace softarm {

/// The valves vent when a command expires: one that comes after that is a step from zero.
class CommandSteps {
 public:
  /// Largest change of a pressure from the command before this one, bar; 0 where that is not known,
  /// as commands between them were lost, and of a command of zero: the daemon goes there at once
  /// where the valves report that they have vented.
  double take(const ChamberCommand& command) {
    const bool expired = has_expired(time_us_, command.validity_us, command.time_us);
    if (expired) before_bar_.setZero(command.pressure_bar.size());
    // A number is left out where the daemon was held up for so long that its decision came too late
    // to be sent; 1 comes from a new daemon.
    const bool known = command.sequence == sequence_ + 1 ||
                       (expired && (command.sequence == sequence_ + 2 || command.sequence == 1));
    const Eigen::Index chambers = std::min(before_bar_.size(), command.pressure_bar.size());
    const double largest_bar =
        known && chambers > 0 && !command.pressure_bar.isZero(0.0)
            ? (command.pressure_bar.head(chambers) - before_bar_.head(chambers))
                  .cwiseAbs()
                  .maxCoeff()
            : 0.0;
    sequence_ = command.sequence;
    time_us_ = command.time_us;
    before_bar_ = command.pressure_bar;
    return largest_bar;
  }

 private:
  std::int64_t sequence_ = -1, time_us_ = 0;
  PressureVector before_bar_;
};

}  // namespace softarm
