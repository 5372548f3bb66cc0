// How far commands move the valves: what a watcher judges the slew by.
#pragma once

#include <algorithm>
#include <cmath>
#include <softarm_messages/pressure_command_t.hpp>
#include <vector>

namespace softarm {

/// The valves vent when a command expires: one that comes after that is a step from zero.
class CommandSteps {
 public:
  /// Largest change of a pressure from the command before this one, bar; 0 where that is not known,
  /// as commands between them were lost.
  float take(const softarm_messages::pressure_command_t& command) {
    const bool expired = command.time_us - time_us_ >= command.validity_us;
    if (expired) before_bar_.assign(command.pressure_bar.size(), 0.0F);
    // A number is left out where the daemon was held up for so long that its decision came too late
    // to be sent; 1 comes from a new daemon.
    const bool known = command.sequence == sequence_ + 1 ||
                       (expired && (command.sequence == sequence_ + 2 || command.sequence == 1));
    float largest_bar = 0.0F;
    for (std::size_t j = 0; known && j < std::min(before_bar_.size(), command.pressure_bar.size());
         ++j)
      largest_bar = std::max(largest_bar, std::abs(command.pressure_bar[j] - before_bar_[j]));
    sequence_ = command.sequence;
    time_us_ = command.time_us;
    before_bar_ = command.pressure_bar;
    return largest_bar;
  }

 private:
  std::int64_t sequence_ = -1, time_us_ = 0;
  std::vector<float> before_bar_;
};

}  // namespace softarm
