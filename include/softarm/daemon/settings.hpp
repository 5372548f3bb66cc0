// What an experiment may choose about the daemon: its rate, its safety thresholds, its place on the
// machine.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "softarm/estimation/clock_relation.hpp"

namespace softarm {

/// What it takes, besides good frames, before the arm is moved.
enum class Arming {
  automatic,  ///< ACTIVE as soon as good frames come (the simulated arm)
  explicit_   ///< waits for an operator's `arm`
};

/// Thresholds of the safety monitor; zero for a time means "derive from control and frame period".
struct SafetySettings {
  Arming arming = Arming::automatic;
  double frame_period_s = 0.005;  ///< nominal, of the motion capture
  double frame_latency_s = 0.0;   ///< declared, from capture to arrival
  double hold_after_s = 0.0;      ///< 0: max(3 T, 3 frame periods + declared latency)
  double vent_after_s = 0.0;      ///< 0: max(100 ms, 10 frame periods, 3 T)
  int good_frames = 50;           ///< in a row, before HOLD or VENT is left
  double max_latency_s = 0.05;    ///< later frames count as stale
  int frozen_frames = 100;  ///< identical poses in a row while the command changes; 0: not checked
  int hold_overruns = 3;    ///< ticks missed in a row, judged only with SCHED_FIFO
  int vent_overruns = 10;   ///< the same
  bool valve_readback = false;   ///< valves publish measured pressures
  double valve_silence_s = 0.1;  ///< without any: a fault
  /// A measured pressure this far outside the range of what was commanded within
  /// pressure_settling_s (to twice that) is a fault, a burst or a leak; 0: not checked.
  double pressure_tolerance_bar = 0.2;
  double pressure_settling_s = 0.3;
  /// |K u + G(u) - A tau_A| of a segment that is larger for curvature_settling_s is a fault; 0: not
  /// checked.
  double curvature_residual_nm = 0.0;
  double curvature_settling_s = 0.5;
  double deadman_timeout_s = 0.2;  ///< without a "go", where there is a dead-man input
};

/// The place of the daemon on the machine.
struct RealtimeSettings {
  bool fifo = false;  ///< SCHED_FIFO for the tick
  int priority = 50;
  int cpu = -1;  ///< pin the tick's thread; -1: do not
  bool lock_memory = false;
};

/// LCM provider and channels; distinct where two arms share a machine.
struct LcmSettings {
  std::string url = "udpm://239.255.76.67:7667?ttl=0";
  std::string mocap_channel = "SOFTARM_MOCAP";
  std::string command_channel = "SOFTARM_PRESSURE_COMMAND";
  std::string measurement_channel = "SOFTARM_PRESSURE";
  std::string reference_channel = "SOFTARM_REFERENCE";
  std::string operator_channel = "SOFTARM_OPERATOR";
  std::string status_channel = "SOFTARM_STATUS";
  std::string timing_channel = "SOFTARM_TIMING";
  std::string tick_channel = "SOFTARM_TICK";  ///< records for replay; empty: none
  std::string valves_channel = "SOFTARM_VALVES";
  std::string plant_channel = "SOFTARM_PLANT";  ///< a simulated arm's true state, for reports
  std::string deadman_channel;                  ///< of a dead-man input; empty: there is none
  double command_validity_s = 0.1;              ///< after which the valve side vents by itself
};

/// Who sends frames, and in which messages.
enum class MocapSourceKind {
  softarm,         ///< mocap_frame_t
  optitrack,       ///< optitrack_frame_t
  rigid_transform  ///< rigid_transform_t, one channel a body: lcm.mocap_channel, _, its name
};
/// In which order the four numbers of a quaternion are sent.
enum class QuaternionOrder { xyzw, wxyz };
/// Of positions as they are sent.
enum class LengthUnit { metre, millimetre };

/// What a frame's numbers mean.
struct MocapSourceSettings {
  MocapSourceKind source = MocapSourceKind::softarm;
  LengthUnit unit = LengthUnit::metre;
  QuaternionOrder quaternion = QuaternionOrder::wxyz;
  /// p_world = axes * p_sent: from the sender's world to ours, whose z axis points up.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
};

/// A marker plate: where on it the frame S_i sits that the arm is made of.
struct PlateSettings {
  std::string name;  ///< of the body, where bodies have names instead of ids
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< of S_i in the body's own frame
  /// Rotation vector of S_i in the body's own frame: R_world_S = R_world_body exp(rotation^).
  Eigen::Vector3d rotation_rad = Eigen::Vector3d::Zero();

  bool operator==(const PlateSettings&) const = default;
};

/// The channel of a body that has one of its own.
inline std::string body_channel(const LcmSettings& lcm, const PlateSettings& plate) {
  return lcm.mocap_channel + "_" + plate.name;
}

/// Which bodies of the motion-capture frame carry the base and the segment ends.
struct BodySettings {
  int base_id = 0;                                 ///< -1: the base is fixed by arm.base
  std::vector<int> segment_ids;                    ///< n ids, from the base to the tip
  PlateSettings base_plate = {};                   ///< not looked at where the base is fixed
  std::vector<PlateSettings> segment_plates = {};  ///< n, or none: S_i are the bodies' own frames
};

/// Rate, safety and connections of softarmd.
struct DaemonSettings {
  double rate_hz = 500.0;
  SafetySettings safety;
  RealtimeSettings realtime;
  /// How a frame's capture time is brought to our monotonic clock; safety.frame_latency_s is the
  /// declared latency of either way.
  ClockMode capture_time = ClockMode::sender;
  LcmSettings lcm;
  MocapSourceSettings mocap;
  BodySettings bodies;
};

}  // namespace softarm
