#include "softarm/client/valves_status.hpp"

#include "softarm/transport/message_decoding.hpp"

namespace softarm {

bool decode(std::span<const std::byte> bytes, ValvesStatus& out) {
  softarm_messages::valves_status_t message;
  if (!decode(bytes, message)) return false;
  const auto pressures = [](const std::vector<float>& list) {
    return Eigen::Map<const Eigen::VectorXf>(list.data(), std::ssize(list)).cast<double>();
  };
  out.time_us = message.time_us;
  out.sequence = message.sequence;
  out.state = static_cast<ValveState>(message.state);
  out.reason = static_cast<ValveReason>(message.reason);
  out.chamber = message.chamber;
  out.cycles = message.cycles;
  out.connections = message.connections;
  out.connections_lost = message.broken;
  out.exceptions = message.exceptions;
  out.no_answers = message.no_answers;
  out.times_degraded = message.doubts;
  out.late_cycles = message.late_cycles;
  out.commands_refused = message.commands_refused;
  out.set_point_bar = pressures(message.set_point_bar);
  out.actual_bar = pressures(message.actual_bar);
  return true;
}

}  // namespace softarm
