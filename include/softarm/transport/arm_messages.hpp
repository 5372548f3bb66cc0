// The messages of a daemon, its valves and a simulated arm as plain values, for every listener.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/estimation/frame_validator.hpp"
#include "softarm/estimation/observer_report.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/runtime/safety_monitor.hpp"

namespace softarm {

/// What a controller measured, decided and commanded in one tick (controller_status_t). Vectors are
/// from base to tip: 2n numbers (pairs per segment), n, or one per chamber.
struct ArmStatus {
  std::int64_t time_us = 0;  ///< the daemon's monotonic clock at the tick
  std::int64_t tick = 0;
  std::int64_t frame_number = 0;  ///< of the newest frame used
  std::uint64_t configuration_hash = 0;
  std::uint64_t seed = 0;
  std::int64_t nonce = 0;  ///< to be echoed by requests
  std::string version;     ///< release and commit
  Mode mode = Mode::init;
  Reason reason = Reason::starting;  ///< why the mode is not ACTIVE

  bool shadow = false;  ///< it computes commands that the valves must not apply
  bool armed = false;
  bool saturated = false;
  bool slew_limited = false;
  bool reference_limited =
      false;  ///< a soft limit changed the reference, or a live reference was refused
  bool soft_limit = false;
  bool bounded = false;         ///< the controller limited a term near a singularity
  bool length_warning = false;  ///< a segment is measured longer or shorter than configured

  double frame_age_s = std::numeric_limits<double>::quiet_NaN();
  std::int64_t frames_accepted = 0;
  std::int64_t frames_rejected = 0;
  FrameVerdict refusal = FrameVerdict::accepted;  ///< of the newest frame, if it was refused
  std::int64_t frames_repeated = 0;
  std::int64_t frames_missing = 0;
  std::int64_t overruns = 0;  ///< ticks missed
  std::int64_t messages_malformed = 0;
  std::array<std::int64_t, kLiveVerdicts> references_refused{};  ///< by LiveVerdict
  std::array<std::int64_t, kLawVerdicts> law_answers{};  ///< of an external law, by LawVerdict
  /// From a state to the arrival of the newest accepted answer of an external law; NaN: none.
  double law_round_trip_s = std::numeric_limits<double>::quiet_NaN();

  SegmentVector u_rad, velocity_radps;         ///< theta (cos phi, sin phi) of every segment
  SegmentVector reference_u_rad;               ///< NaN unless ACTIVE
  SegmentVector tau_actuation_nm;              ///< NaN unless ACTIVE
  SegmentScalars phi_rad, theta_rad;           ///< the same u in polar coordinates
  SegmentScalars torsion_rad, length_error_m;  ///< residuals: a PCC segment has none
  PressureVector pressure_bar;                 ///< commanded, bar; N m with actuation by torque
  /// n each where segments stretch, otherwise empty: m, m/s, m and N; the last two NaN unless ACTIVE.
  SegmentScalars elongation_m, elongation_rate_mps, reference_elongation_m, axial_force_n;

  /// Number of segments n.
  int segments() const noexcept { return static_cast<int>(theta_rad.size()); }
  /// Whether it pressurises the arm, or may do so in its next tick without a further request.
  bool may_pressurise() const noexcept {
    return armed || mode == Mode::active || mode == Mode::hold;
  }
  /// The reason, such as "frames_stale" or "frames_refused: bad_length".
  std::string reason_text() const;
  /// Mode and reason, such as "VENT (frames_stale)".
  std::string text() const;
};

/// What the model-based observer knows in one tick (observer_status_t).
struct ObserverStatus {
  std::int64_t time_us = 0;  ///< the daemon's monotonic clock at the tick
  std::int64_t tick = 0;
  ObserverReport report;
};

/// True state of a simulated arm (plant_state_t), which no sensor of a real arm measures
/// completely.
struct PlantState {
  std::int64_t time_us = 0;             ///< monotonic clock of the simulator
  bool vented = false;                  ///< no command is valid: all valves are at zero
  SegmentVector u_rad, velocity_radps;  ///< 2n numbers each
  PressureVector pressure_bar;          ///< behind the valves; N m with actuation by torque
  Eigen::Vector3d tip_m = Eigen::Vector3d::Zero();   ///< world frame
  SegmentScalars elongation_m, elongation_rate_mps;  ///< n where segments stretch, otherwise empty

  /// Number of segments n.
  int segments() const noexcept { return static_cast<int>(u_rad.size() / 2); }
};

/// Set points for every valve as they were sent (pressure_command_t, torque_command_t).
struct ChamberCommand {
  std::int64_t sequence = 0;
  std::int64_t time_us = 0;      ///< monotonic clock of the sender
  std::int64_t validity_us = 0;  ///< how long it may be held after arrival
  bool shadow = false;           ///< computed for inspection, never applied to valves
  PressureVector pressure_bar;   ///< gauge pressure; N m for a command of torques
};

/// What an external law is to answer (law_state_t): 2n numbers each, of the instant at which an
/// answer acts that comes within one tick.
struct LawRequest {
  std::int64_t tick = 0;
  std::int64_t time_us = 0;  ///< the daemon's monotonic clock at the tick
  std::int64_t nonce = 0;    ///< to be echoed by the answer
  Mode mode = Mode::init;
  double active_s = 0.0;  ///< since the arm became ACTIVE; 0 where it is not
  SegmentVector u_rad, velocity_radps;
  /// Unless ACTIVE at rest at u_rad: so it will begin.
  SegmentVector reference_u_rad, reference_velocity_radps, reference_acceleration_radps2;
  PressureVector pressure_bar;  ///< commanded, bar; N m with actuation by torque
};

/// Decodes one controller_status_t as message_decoding.hpp does: returns false, and leaves `out`
/// unspecified, unless `bytes` are exactly one message of the type. Values are not checked.
bool decode(std::span<const std::byte> bytes, ArmStatus& out);
/// The same of an observer_status_t.
bool decode(std::span<const std::byte> bytes, ObserverStatus& out);
/// The same of a law_state_t.
bool decode(std::span<const std::byte> bytes, LawRequest& out);
/// The same of a plant_state_t.
bool decode(std::span<const std::byte> bytes, PlantState& out);
/// The same of a pressure_command_t, or of a torque_command_t where `by_torque`.
bool decode(std::span<const std::byte> bytes, bool by_torque, ChamberCommand& out);

}  // namespace softarm
