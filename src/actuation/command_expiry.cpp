#include "softarm/actuation/command_expiry.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {

int checked_count(int chambers) {
  if (chambers < 0) {
    throw std::invalid_argument("commands: expected a count of chambers >= 0, got " +
                                std::to_string(chambers));
  }
  return chambers;
}

}  // namespace

CommandExpiry::CommandExpiry(int chambers, std::int64_t longest_ns)
    : longest_ns_(longest_ns), set_points_bar_(Eigen::VectorXd::Zero(checked_count(chambers))) {}

CommandVerdict CommandExpiry::receive(const PressureCommand& command,
                                      std::int64_t arrival_ns) noexcept {
  update(arrival_ns);
  if (command.shadow) {
    return CommandVerdict::shadow;
  }
  const auto finite = [](double pressure) { return std::isfinite(pressure); };
  if (command.validity_ns <= 0 || command.sequence < 0 ||
      command.pressure_bar.size() != static_cast<std::size_t>(set_points_bar_.size()) ||
      !std::all_of(command.pressure_bar.begin(), command.pressure_bar.end(), finite)) {
    return CommandVerdict::malformed;
  }
  if (command.sequence <= sequence_) {
    return CommandVerdict::older;
  }
  sequence_ = command.sequence;
  // Saturating: an unlimited validity must not wrap around into the past.
  const std::int64_t validity_ns = std::min(command.validity_ns, longest_ns_);
  expires_ns_ = validity_ns < kForever - 1 - arrival_ns ? arrival_ns + validity_ns : kForever - 1;
  std::copy(command.pressure_bar.begin(), command.pressure_bar.end(), set_points_bar_.data());
  return CommandVerdict::in_force;
}

bool CommandExpiry::update(std::int64_t now_ns) noexcept {
  if (now_ns < expires_ns_ || vented()) {
    return false;
  }
  expires_ns_ = kForever;
  sequence_ = kNoSequence;
  set_points_bar_.setZero();
  return true;
}

}  // namespace softarm
