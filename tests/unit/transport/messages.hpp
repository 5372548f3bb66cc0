// Valid messages of every type, of any size, with numbers that can be distinguished.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "softarm/transport/message_decoding.hpp"

namespace softarm::test {

using Bytes = std::vector<std::byte>;

template <class Message>
Bytes encoded(const Message& message) {
  Bytes bytes(static_cast<std::size_t>(message.getEncodedSize()));
  if (message.encode(bytes.data(), 0, static_cast<int>(bytes.size())) !=
      static_cast<int>(bytes.size()))
    bytes.clear();
  return bytes;
}

template <class Number>
std::vector<Number> numbers(int count, double first) {
  std::vector<Number> list;
  for (int k = 0; k < count; ++k) list.push_back(static_cast<Number>(first + 0.25 * k));
  return list;
}
template <class Number>
std::vector<std::vector<Number>> pairs(int count, double first) {
  std::vector<std::vector<Number>> list;
  for (int k = 0; k < count; ++k) list.push_back(numbers<Number>(2, first + k));
  return list;
}

/// A message for `segments` segments of `chambers` chambers each; its bodies include the base.
template <class Message>
Message example(int segments, int chambers);

template <>
inline softarm_messages::mocap_frame_t example(int segments, int /*chambers*/) {
  softarm_messages::mocap_frame_t message;
  message.frame_number = 123'456'789'012;
  message.capture_time_us = -5;
  message.num_bodies = static_cast<std::int16_t>(segments + 1);
  for (int i = 0; i <= segments; ++i) {
    softarm_messages::mocap_body_t body{};
    body.id = 1000 * i - 7;
    body.valid = i % 2 == 0;
    for (int axis = 0; axis < 3; ++axis) body.position_m[axis] = 0.1 * i + axis;
    for (int k = 0; k < 4; ++k) body.orientation[k] = 0.5 - k - i;
    message.bodies.push_back(body);
  }
  return message;
}

template <>
inline softarm_messages::rigid_transform_t example(int segments, int chambers) {
  softarm_messages::rigid_transform_t message;
  message.utime = 1'000'000 + segments;
  for (int k = 0; k < 3; ++k) message.trans[k] = 0.1 * k + chambers;
  for (int k = 0; k < 4; ++k) message.quat[k] = 0.5 - k;
  return message;
}

template <>
inline softarm_messages::pressure_command_t example(int segments, int chambers) {
  return {.sequence = 42,
          .time_us = 43,
          .validity_us = 100'000,
          .shadow = 1,
          .num_chambers = static_cast<std::int16_t>(segments * chambers),
          .pressure_bar = numbers<float>(segments * chambers, 0.5)};
}

template <>
inline softarm_messages::torque_command_t example(int segments, int /*chambers*/) {
  return {.sequence = 42,
          .time_us = 43,
          .validity_us = 100'000,
          .shadow = 0,
          .num_moments = static_cast<std::int16_t>(2 * segments),
          .torque_nm = numbers<double>(2 * segments, -0.5)};
}

template <>
inline softarm_messages::pressure_measurement_t example(int segments, int chambers) {
  return {.sequence = 5,
          .time_us = 44,
          .expired = 3,
          .validity_us = 0,
          .reason = 0,
          .num_chambers = static_cast<std::int16_t>(segments * chambers),
          .pressure_bar = numbers<float>(segments * chambers, 0.125)};
}

template <>
inline softarm_messages::curvature_reference_t example(int segments, int /*chambers*/) {
  return {.sequence = 7,
          .dimension = static_cast<std::int16_t>(2 * segments),
          .u_rad = numbers<double>(2 * segments, 0.1),
          .velocity_radps = numbers<double>(2 * segments, 100.1),
          .acceleration_radps2 = numbers<double>(2 * segments, -100.1)};
}

template <>
inline softarm_messages::operator_command_t example(int /*segments*/, int /*chambers*/) {
  return {.sequence = 99, .nonce = -98, .request = softarm_messages::operator_command_t::ARM};
}

template <>
inline softarm_messages::deadman_t example(int /*segments*/, int /*chambers*/) {
  return {.sequence = 100, .nonce = -101, .go = 1};
}

template <>
inline softarm_messages::controller_status_t example(int segments, int chambers) {
  softarm_messages::controller_status_t message{};
  message.tick = 17;
  message.nonce = -18;
  message.version = "0.1.0 0123456789abcdef0123456789abcdef01234567-dirty";
  message.mode = 2;
  message.flags = 33;
  message.frame_age_s = 0.005F;
  message.messages_malformed = 3;
  for (int k = 0; k < 10; ++k) message.references_refused[k] = 10 + k;
  for (int k = 0; k < 8; ++k) message.law_answers[k] = 20 + k;
  message.law_round_trip_s = 0.0015F;
  message.num_segments = static_cast<std::int16_t>(segments);
  message.num_chambers = static_cast<std::int16_t>(segments * chambers);
  message.u_rad = pairs<float>(segments, 1.0);
  message.velocity_radps = pairs<float>(segments, 100.0);
  message.reference_u_rad = pairs<float>(segments, 200.0);
  message.phi_rad = numbers<float>(segments, 300.0);
  message.theta_rad = numbers<float>(segments, 400.0);
  message.tau_actuation_nm = pairs<float>(segments, 500.0);
  message.residual_twist_rad = numbers<float>(segments, 600.0);
  message.residual_length_m = numbers<float>(segments, 700.0);
  message.pressure_bar = numbers<float>(segments * chambers, 800.0);
  return message;
}

template <>
inline softarm_messages::tip_target_t example(int /*segments*/, int /*chambers*/) {
  return {.sequence = 51, .position_m = {0.1, 0.2, -0.3}, .velocity_mps = {0.4, 0.5, 0.6}};
}

template <>
inline softarm_messages::law_state_t example(int segments, int chambers) {
  const auto dimension = static_cast<std::int16_t>(2 * segments);
  return {.tick = 19,
          .time_us = 47,
          .nonce = -48,
          .mode = 2,
          .active_s = 0.25,
          .dimension = dimension,
          .num_chambers = static_cast<std::int16_t>(segments * chambers),
          .u_rad = numbers<double>(dimension, 0.1),
          .velocity_radps = numbers<double>(dimension, 100.1),
          .reference_u_rad = numbers<double>(dimension, 200.1),
          .reference_velocity_radps = numbers<double>(dimension, 300.1),
          .reference_acceleration_radps2 = numbers<double>(dimension, -300.1),
          .pressure_bar = numbers<float>(segments * chambers, 800.0)};
}

template <>
inline softarm_messages::law_command_t example(int segments, int chambers) {
  return {.sequence = 49,
          .nonce = -50,
          .validity_us = 50'000,
          .answer = softarm_messages::law_command_t::PRESSURES,
          .num_values = static_cast<std::int16_t>(segments * chambers),
          .value = numbers<double>(segments * chambers, 0.5)};
}

template <>
inline softarm_messages::plant_state_t example(int segments, int chambers) {
  softarm_messages::plant_state_t message{};
  message.time_us = 45;
  message.vented = 1;
  message.num_segments = static_cast<std::int16_t>(segments);
  message.num_chambers = static_cast<std::int16_t>(segments * chambers);
  message.u_rad = pairs<double>(segments, 1.0);
  message.velocity_radps = pairs<double>(segments, 50.0);
  message.pressure_bar = numbers<float>(segments * chambers, 0.0);
  for (int axis = 0; axis < 3; ++axis) message.tip_m[axis] = axis;
  return message;
}

template <>
inline softarm_messages::valves_status_t example(int segments, int chambers) {
  softarm_messages::valves_status_t message{};
  message.time_us = 46;
  message.sequence = -1;
  message.state = 5;
  message.reason = 8;
  message.chamber = -1;
  message.late_cycles = 9;
  message.num_chambers = static_cast<std::int16_t>(segments * chambers);
  message.set_point_bar = numbers<float>(segments * chambers, 0.0);
  message.actual_bar = numbers<float>(segments * chambers, 3.0);
  return message;
}

template <>
inline softarm_messages::observer_status_t example(int segments, int /*chambers*/) {
  softarm_messages::observer_status_t message{};
  message.time_us = 47;
  message.tick = 48;
  message.flags = softarm_messages::observer_status_t::RUNNING;
  message.failures = 2;
  message.nis = 0.75F;
  message.force_n[2] = -3.0F;
  message.force_covariance_n2[1][1] = 4.0F;
  message.num_segments = static_cast<std::int16_t>(segments);
  message.stiffness = numbers<float>(segments, 1.0);
  message.damping = numbers<float>(segments, 100.0);
  message.gain = numbers<float>(segments, 200.0);
  message.load = pairs<float>(segments, 300.0);
  message.disturbance_nm = pairs<float>(segments, 400.0);
  message.stiffness_deviation = numbers<float>(segments, 500.0);
  message.damping_deviation = numbers<float>(segments, 600.0);
  message.gain_deviation = numbers<float>(segments, 700.0);
  message.load_deviation = pairs<float>(segments, 800.0);
  message.disturbance_deviation_nm = pairs<float>(segments, 900.0);
  return message;
}

template <>
inline softarm_messages::timing_t example(int /*segments*/, int /*chambers*/) {
  softarm_messages::timing_t message{};
  message.ticks = 1'000'000;
  for (int k = 0; k < 32; ++k) {
    message.lateness_count[k] = k;
    message.publish_count[k] = 100 - k;
  }
  message.max_us[3] = 1.5F;
  return message;
}

template <>
inline softarm_messages::tick_record_t example(int segments, int chambers) {
  softarm_messages::tick_record_t message{};
  message.tick = 18;
  message.num_chambers = static_cast<std::int16_t>(segments * chambers);
  message.dimension = static_cast<std::int16_t>(segments < 10 ? 2 * segments : 0);
  message.num_frames = 1;
  message.pressure_bar = numbers<double>(segments * chambers, 0.5);
  message.u_rad = numbers<double>(message.dimension, 0.1);
  message.velocity_radps = numbers<double>(message.dimension, 100.1);
  message.acceleration_radps2 = numbers<double>(message.dimension, -100.1);
  const auto frame = example<softarm_messages::mocap_frame_t>(segments, chambers);
  message.frames.push_back(
      {.frame_number = 5, .capture_ns = 6, .num_bodies = frame.num_bodies, .bodies = frame.bodies});
  message.num_measured = message.num_chambers;
  message.measured_bar = numbers<float>(message.num_chambers, 4000.0);
  message.law_answer = segments < 10 ? softarm_messages::law_command_t::FORCE : std::int8_t{-1};
  message.num_law = message.dimension;
  message.law_value = numbers<double>(message.num_law, -0.5);
  message.num_tip = segments < 10 ? 6 : 0;
  message.tip_target = numbers<double>(message.num_tip, -1.5);
  message.build = "softarm 0.1.0 commit 0123456789-dirty";
  message.digest = -7;
  return message;
}

}  // namespace softarm::test
