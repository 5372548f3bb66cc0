// Decodes messages from the network. LCM's generated decoders trust the lengths they read and
// accept trailing bytes, so every size is checked here before they run.
#pragma once

#include <cstddef>
#include <softarm_messages/controller_status_t.hpp>
#include <softarm_messages/curvature_reference_t.hpp>
#include <softarm_messages/deadman_t.hpp>
#include <softarm_messages/law_command_t.hpp>
#include <softarm_messages/law_state_t.hpp>
#include <softarm_messages/mocap_frame_t.hpp>
#include <softarm_messages/observer_status_t.hpp>
#include <softarm_messages/operator_command_t.hpp>
#include <softarm_messages/plant_state_t.hpp>
#include <softarm_messages/pressure_command_t.hpp>
#include <softarm_messages/pressure_measurement_t.hpp>
#include <softarm_messages/rigid_transform_t.hpp>
#include <softarm_messages/tick_record_t.hpp>
#include <softarm_messages/timing_t.hpp>
#include <softarm_messages/tip_target_t.hpp>
#include <softarm_messages/torque_command_t.hpp>
#include <softarm_messages/valves_status_t.hpp>
#include <span>

namespace softarm {

/// @name Decoding
/// Each function returns false, and leaves `message` unspecified, unless `bytes` are exactly what
/// the encoder of its type writes: the right hash, lengths within the capacities of this project,
/// terminated texts, no byte missing or left over. Values are not checked. Allocates nothing once
/// `message` has held one of the same size.
/// @{

/// Decodes a mocap_frame_t.
bool decode(std::span<const std::byte> bytes, softarm_messages::mocap_frame_t& message) noexcept;
/// Decodes a pressure_command_t.
bool decode(std::span<const std::byte> bytes,
            softarm_messages::pressure_command_t& message) noexcept;
/// Decodes a torque_command_t.
bool decode(std::span<const std::byte> bytes, softarm_messages::torque_command_t& message) noexcept;
/// Decodes a pressure_measurement_t.
bool decode(std::span<const std::byte> bytes,
            softarm_messages::pressure_measurement_t& message) noexcept;
/// Decodes a curvature_reference_t.
bool decode(std::span<const std::byte> bytes,
            softarm_messages::curvature_reference_t& message) noexcept;
/// Decodes a operator_command_t.
bool decode(std::span<const std::byte> bytes,
            softarm_messages::operator_command_t& message) noexcept;
/// Decodes a controller_status_t.
bool decode(std::span<const std::byte> bytes,
            softarm_messages::controller_status_t& message) noexcept;
/// Decodes a tip_target_t.
bool decode(std::span<const std::byte> bytes, softarm_messages::tip_target_t& message) noexcept;
/// Decodes a law_state_t.
bool decode(std::span<const std::byte> bytes, softarm_messages::law_state_t& message) noexcept;
/// Decodes a law_command_t.
bool decode(std::span<const std::byte> bytes, softarm_messages::law_command_t& message) noexcept;
/// Decodes a plant_state_t.
bool decode(std::span<const std::byte> bytes, softarm_messages::plant_state_t& message) noexcept;
/// Decodes a timing_t.
bool decode(std::span<const std::byte> bytes, softarm_messages::timing_t& message) noexcept;
/// Decodes an observer_status_t.
bool decode(std::span<const std::byte> bytes,
            softarm_messages::observer_status_t& message) noexcept;
/// Decodes a tick_record_t.
bool decode(std::span<const std::byte> bytes, softarm_messages::tick_record_t& message) noexcept;
/// Decodes a valves_status_t.
bool decode(std::span<const std::byte> bytes, softarm_messages::valves_status_t& message) noexcept;
/// Decodes a deadman_t.
bool decode(std::span<const std::byte> bytes, softarm_messages::deadman_t& message) noexcept;
/// Decodes a rigid_transform_t.
bool decode(std::span<const std::byte> bytes,
            softarm_messages::rigid_transform_t& message) noexcept;
/// @}

}  // namespace softarm
