#include "softarm/transport/arm_messages.hpp"

#include <algorithm>
#include <vector>

#include "softarm/transport/message_decoding.hpp"

namespace softarm {
namespace {

template <class Vector, class Number>
void flatten(const std::vector<std::vector<Number>>& pairs, Vector& flat) {
  flat.resize(static_cast<Eigen::Index>(2 * pairs.size()));
  Eigen::Index k = 0;
  for (const std::vector<Number>& pair : pairs)
    for (const Number each : pair) flat[k++] = static_cast<double>(each);
}

template <class Vector, class Number>
void copy(const std::vector<Number>& from, Vector& to) {
  using Numbers = Eigen::Matrix<Number, Eigen::Dynamic, 1>;
  to = Eigen::Map<const Numbers>(from.data(), static_cast<Eigen::Index>(from.size()))
           .template cast<double>();
}

}  // namespace

std::string ArmStatus::reason_text() const {
  const bool refused = reason == Reason::frames_refused && refusal != FrameVerdict::accepted;
  return name(reason) + (refused ? std::string(": ") + name(refusal) : "");
}

std::string ArmStatus::text() const { return std::string(name(mode)) + " (" + reason_text() + ")"; }

bool decode(std::span<const std::byte> bytes, ArmStatus& out) {
  using Message = softarm_messages::controller_status_t;
  Message message;
  if (!decode(bytes, message)) return false;
  const auto has = [&](std::int16_t flag) { return (message.flags & flag) != 0; };
  out.time_us = message.time_us;
  out.tick = message.tick;
  out.frame_number = message.frame_number;
  out.configuration_hash = static_cast<std::uint64_t>(message.configuration_hash);
  out.seed = static_cast<std::uint64_t>(message.seed);
  out.nonce = message.nonce;
  out.version = message.version;
  out.mode = static_cast<Mode>(message.mode);
  out.reason = static_cast<Reason>(message.reason);
  out.shadow = has(Message::SHADOW);
  out.armed = has(Message::ARMED);
  out.saturated = has(Message::SATURATED);
  out.slew_limited = has(Message::SLEW_LIMITED);
  out.reference_limited = has(Message::REFERENCE_LIMITED);
  out.soft_limit = has(Message::SOFT_LIMIT);
  out.bounded = has(Message::BOUNDED);
  out.length_warning = has(Message::LENGTH);
  out.frame_age_s = static_cast<double>(message.frame_age_s);
  out.frames_accepted = message.frames_accepted;
  out.frames_rejected = message.frames_rejected;
  out.refusal = static_cast<FrameVerdict>(message.refusal);
  out.frames_repeated = message.frames_repeated;
  out.frames_missing = message.frames_missing;
  out.overruns = message.overruns;
  out.messages_malformed = message.messages_malformed;
  std::copy_n(message.references_refused, kLiveVerdicts, out.references_refused.begin());
  std::copy_n(message.law_answers, kLawVerdicts, out.law_answers.begin());
  out.law_round_trip_s = static_cast<double>(message.law_round_trip_s);
  flatten(message.u_rad, out.u_rad);
  flatten(message.velocity_radps, out.velocity_radps);
  flatten(message.reference_u_rad, out.reference_u_rad);
  flatten(message.tau_actuation_nm, out.tau_actuation_nm);
  copy(message.phi_rad, out.phi_rad);
  copy(message.theta_rad, out.theta_rad);
  copy(message.residual_twist_rad, out.torsion_rad);
  copy(message.residual_length_m, out.length_error_m);
  copy(message.pressure_bar, out.pressure_bar);
  copy(message.elongation_m, out.elongation_m);
  copy(message.elongation_rate_mps, out.elongation_rate_mps);
  copy(message.reference_elongation_m, out.reference_elongation_m);
  copy(message.axial_force_n, out.axial_force_n);
  return true;
}

bool decode(std::span<const std::byte> bytes, ObserverStatus& out) {
  using Message = softarm_messages::observer_status_t;
  Message message;
  if (!decode(bytes, message)) return false;
  const auto has = [&](std::int16_t flag) { return (message.flags & flag) != 0; };
  ObserverReport& report = out.report;
  out.time_us = message.time_us;
  out.tick = message.tick;
  report.segments = message.num_segments;
  report.running = has(Message::RUNNING);
  report.surprised = has(Message::SURPRISED);
  report.wrong_model = has(Message::WRONG_MODEL);
  report.contact = has(Message::CONTACT);
  report.pressure_loss = has(Message::PRESSURE_LOSS);
  report.failures = message.failures;
  report.nis = static_cast<double>(message.nis);
  for (Eigen::Index i = 0; i < 3; ++i) {
    report.force_n[i] = static_cast<double>(message.force_n[i]);
    for (Eigen::Index j = 0; j < 3; ++j)
      report.force_covariance_n2(i, j) = static_cast<double>(message.force_covariance_n2[i][j]);
  }
  const auto take = [&](const auto& stiffness, const auto& damping, const auto& gain,
                        const auto& load, const auto& disturbance_nm, ModelCorrection& into) {
    for (std::size_t i = 0; i < stiffness.size(); ++i)
      into.segment[i] = {
          .stiffness = static_cast<double>(stiffness[i]),
          .damping = static_cast<double>(damping[i]),
          .gain = static_cast<double>(gain[i]),
          .load = {static_cast<double>(load[i][0]), static_cast<double>(load[i][1])}};
    flatten(disturbance_nm, into.disturbance_nm);
  };
  take(message.stiffness, message.damping, message.gain, message.load, message.disturbance_nm,
       report.correction);
  take(message.stiffness_deviation, message.damping_deviation, message.gain_deviation,
       message.load_deviation, message.disturbance_deviation_nm, report.deviation);
  const auto take_axial = [](const auto& force_n, const auto& stiffness, const auto& damping,
                             const auto& gain, ModelCorrection& into) {
    for (std::size_t i = 0; i < force_n.size(); ++i) {
      into.segment[i].axial_force_n = static_cast<double>(force_n[i]);
      into.segment[i].axial_stiffness = static_cast<double>(stiffness[i]);
      into.segment[i].axial_damping = static_cast<double>(damping[i]);
      into.segment[i].axial_gain = static_cast<double>(gain[i]);
    }
  };
  copy(message.elongation_m, report.elongation_m);
  copy(message.elongation_deviation_m, report.elongation_deviation_m);
  take_axial(message.axial_force_n, message.axial_stiffness, message.axial_damping,
             message.axial_gain, report.correction);
  take_axial(message.axial_force_deviation_n, message.axial_stiffness_deviation,
             message.axial_damping_deviation, message.axial_gain_deviation, report.deviation);
  return true;
}

bool decode(std::span<const std::byte> bytes, LawRequest& out) {
  softarm_messages::law_state_t message;
  if (!decode(bytes, message)) return false;
  out.tick = message.tick;
  out.time_us = message.time_us;
  out.nonce = message.nonce;
  out.mode = static_cast<Mode>(message.mode);
  out.active_s = message.active_s;
  copy(message.u_rad, out.u_rad);
  copy(message.velocity_radps, out.velocity_radps);
  copy(message.reference_u_rad, out.reference_u_rad);
  copy(message.reference_velocity_radps, out.reference_velocity_radps);
  copy(message.reference_acceleration_radps2, out.reference_acceleration_radps2);
  copy(message.pressure_bar, out.pressure_bar);
  return true;
}

bool decode(std::span<const std::byte> bytes, PlantState& out) {
  softarm_messages::plant_state_t message;
  if (!decode(bytes, message)) return false;
  out.time_us = message.time_us;
  out.vented = message.vented != 0;
  flatten(message.u_rad, out.u_rad);
  flatten(message.velocity_radps, out.velocity_radps);
  copy(message.pressure_bar, out.pressure_bar);
  out.tip_m = Eigen::Map<const Eigen::Vector3d>(message.tip_m);
  copy(message.elongation_m, out.elongation_m);
  copy(message.elongation_rate_mps, out.elongation_rate_mps);
  return true;
}

bool decode(std::span<const std::byte> bytes, bool by_torque, ChamberCommand& out) {
  const auto take = [&](const auto& message, const auto& values) {
    out.sequence = message.sequence;
    out.time_us = message.time_us;
    out.validity_us = message.validity_us;
    out.shadow = message.shadow != 0;
    copy(values, out.pressure_bar);
  };
  if (by_torque) {
    softarm_messages::torque_command_t message;
    if (!decode(bytes, message)) return false;
    take(message, message.torque_nm);
  } else {
    softarm_messages::pressure_command_t message;
    if (!decode(bytes, message)) return false;
    take(message, message.pressure_bar);
  }
  return true;
}

}  // namespace softarm
