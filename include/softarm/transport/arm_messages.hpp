// What a daemon, its valves and a simulated arm publish, as plain values: for everybody who
// listens.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/runtime/safety_monitor.hpp"

namespace softarm {

/// What a controller saw, decided and commanded in one tick (controller_status_t). Vectors are from
/// base to tip: 2n numbers, n, or one a chamber.
struct ArmStatus {
  std::int64_t time_us = 0;  ///< the daemon's monotonic clock at the tick
  std::int64_t tick = 0;
  std::int64_t frame_number = 0;  ///< of the newest frame used
  std::uint64_t configuration_hash = 0;
  std::uint64_t seed = 0;
  std::string version;  ///< release and commit
  Mode mode = Mode::init;
  Reason reason = Reason::starting;  ///< why the mode is not ACTIVE

  bool shadow = false;  ///< it computes commands that are not for the valves
  bool armed = false;
  bool saturated = false;
  bool slew_limited = false;
  bool reference_limited = false;  ///< a soft limit bent the reference, or a live one was refused
  bool soft_limit = false;
  bool bounded = false;  ///< the controller bounded something near a singularity

  double frame_age_s = std::numeric_limits<double>::quiet_NaN();
  std::int64_t frames_accepted = 0;
  std::int64_t frames_rejected = 0;
  std::int64_t frames_repeated = 0;
  std::int64_t frames_missing = 0;
  std::int64_t overruns = 0;  ///< ticks missed
  std::int64_t messages_malformed = 0;

  SegmentVector u_rad, velocity_radps;         ///< theta (cos phi, sin phi) of every segment
  SegmentVector reference_u_rad;               ///< NaN unless ACTIVE
  SegmentVector tau_actuation_nm;              ///< NaN unless ACTIVE
  SegmentScalars phi_rad, theta_rad;           ///< the same u in polar coordinates
  SegmentScalars torsion_rad, length_error_m;  ///< what a PCC segment cannot have: residuals
  PressureVector pressure_bar;                 ///< commanded; N m with actuation by torque

  int segments() const noexcept { return static_cast<int>(theta_rad.size()); }
  /// It pressurises the arm, or may do so in its next tick without being asked by anybody.
  bool may_pressurise() const noexcept {
    return armed || mode == Mode::active || mode == Mode::hold;
  }
  /// "VENT (frames_stale)".
  std::string text() const;
};

/// What a simulated arm really does, which no sensor of a real one would show (plant_state_t).
struct PlantState {
  std::int64_t time_us = 0;  ///< its monotonic clock
  bool vented = false;       ///< no command is in force: all valves are at zero
  SegmentVector u_rad, velocity_radps;
  PressureVector pressure_bar;  ///< behind the valves; N m with actuation by torque
  Eigen::Vector3d tip_m = Eigen::Vector3d::Zero();  ///< world frame

  int segments() const noexcept { return static_cast<int>(u_rad.size() / 2); }
};

/// Set points for every valve, as somebody sent them (pressure_command_t, torque_command_t).
struct ChamberCommand {
  std::int64_t sequence = 0;
  std::int64_t time_us = 0;      ///< the sender's monotonic clock
  std::int64_t validity_us = 0;  ///< how long it may be held
  bool shadow = false;           ///< computed for inspection, never to be applied to valves
  PressureVector pressure_bar;   ///< above ambient; N m where it is made of torques
};

/// As message_decoding.hpp: false, and `out` unspecified, unless `bytes` are exactly one message of
/// the type; values are not judged.
bool decode(std::span<const std::byte> bytes, ArmStatus& out);
bool decode(std::span<const std::byte> bytes, PlantState& out);
/// @param by_torque  a torque_command_t is meant
bool decode(std::span<const std::byte> bytes, bool by_torque, ChamberCommand& out);

}  // namespace softarm
