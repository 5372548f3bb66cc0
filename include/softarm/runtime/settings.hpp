// What an experiment may choose about the tick: its rate and the thresholds of the safety monitor.
#pragma once

#include "softarm/actuation/settings.hpp"
#include "softarm/control/settings.hpp"
#include "softarm/estimation/settings.hpp"
#include "softarm/model/arm.hpp"

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
  bool deadman = false;            ///< there is a dead-man input
  double deadman_timeout_s = 0.2;  ///< without a "go" from it
  /// How long a command is valid: the valve side vents by itself when no newer one comes.
  double command_validity_s = 0.1;
};

/// Everything the pipeline of a tick is built from; an experiment adds the wire, the simulated arm
/// and the run to it.
struct PipelineSettings {
  ArmParameters arm;  ///< as the controller models it
  EstimationSettings estimation;
  ControllerSettings control;
  ReferenceSettings reference;
  ActuationSettings actuation;
  SafetySettings safety;
  double rate_hz = 500.0;  ///< of the tick
};

}  // namespace softarm
