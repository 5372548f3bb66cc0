#include "softarm/actuation/command_expiry.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {

/// Numbers by which a packet may be overtaken.
constexpr std::int64_t kOvertaken = 16;
/// A packet's delay varies by less.
constexpr std::int64_t kDelay_us = 500'000;

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

/// `in_force` for the next command of the same sender.
CommandVerdict CommandExpiry::compare(const PressureCommand& command,
                                      std::int64_t arrival_ns) const noexcept {
  if (vented()) return CommandVerdict::in_force;
  const bool newer = command.sequence > sequence_;
  const bool has_clock = command.sent_us > 0;
  if (has_clock != (sent_us_ > 0)) return CommandVerdict::other_sender;
  if (newer) {
    if (!has_clock) return CommandVerdict::in_force;
    // Compared without a difference of two numbers from the wire, which may overflow.
    const std::int64_t passed_us = (arrival_ns - arrival_ns_) / 1000;
    const bool fits =
        command.sent_us >= sent_us_ && command.sent_us - sent_us_ <= passed_us + kDelay_us;
    return fits ? CommandVerdict::in_force : CommandVerdict::other_sender;
  }
  const std::int64_t back = sequence_ - command.sequence;  // neither is negative
  const bool fits =
      back == 0 ? command.sent_us == sent_us_
                : back <= kOvertaken && (!has_clock || (command.sent_us <= sent_us_ &&
                                                        sent_us_ - command.sent_us <= kDelay_us));
  return fits ? CommandVerdict::older : CommandVerdict::other_sender;
}

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
  if (const CommandVerdict verdict = compare(command, arrival_ns);
      verdict != CommandVerdict::in_force) {
    return verdict;
  }
  sequence_ = command.sequence;
  sent_us_ = command.sent_us;
  arrival_ns_ = arrival_ns;
  asked_ns_ = command.validity_ns;
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
  vent();
  return true;
}

void CommandExpiry::vent() noexcept {
  expires_ns_ = kForever;
  sequence_ = kNoSequence;
  set_points_bar_.setZero();
}

}  // namespace softarm
