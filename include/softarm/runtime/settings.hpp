// Settings of the tick: its rate and the thresholds of the safety monitor. config/template.yaml
// documents every setting.
#pragma once

#include "softarm/actuation/settings.hpp"
#include "softarm/control/settings.hpp"
#include "softarm/estimation/settings.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// What is required, besides good frames, before the arm may move.
enum class Arming {
  automatic,  ///< ACTIVE as soon as good frames come (the simulated arm)
  explicit_   ///< waits for an operator's `arm`
};

/// What a contact leads to.
enum class ContactReaction {
  hold,  ///< HOLD until it has gone
  vent,  ///< VENT until an operator arms again
  yield  ///< ACTIVE, but what pushes is not compensated: the arm is as soft as K + K_P
};

/// Thresholds of the safety monitor; zero for a time means "derive from control and frame period".
struct SafetySettings {
  Arming arming = Arming::automatic;
  double frame_period_s = 0.005;
  double frame_latency_s = 0.0;
  double hold_after_s = 0.0;
  double vent_after_s = 0.0;
  int good_frames = 50;
  int most_activations = 5;  ///< a minute, without an operator's `arm`
  double max_latency_s = 0.05;
  int frozen_frames = 100;
  int hold_overruns = 3;
  int vent_overruns = 10;
  bool valve_readback = false;
  double valve_silence_s = 0.1;
  double pressure_tolerance_bar = 0.2;
  double pressure_settling_s = 0.3;
  double curvature_residual_nm = 0.0;
  double curvature_settling_s = 0.5;
  double oscillation_rad = 0.05;
  int oscillation_periods = 4;
  double oscillation_lowest_hz = 0.5;
  double oscillation_part = 0.5;
  double length_warning = 0.05;
  double length_fault = 0.1;
  double length_settling_s = 0.5;
  double wrong_model_settling_s = 1.0;
  double contact_force_n = 0.0;
  ContactReaction contact_reaction = ContactReaction::hold;
  int contact_segment = 0;  ///< 0: the tip
  bool deadman = false;     ///< there is a dead-man input
  double deadman_timeout_s = 0.2;
  /// Longest time from a state to the end of validity of an external law's answer to it, and from
  /// there to VENT.
  double law_validity_s = 0.1;
  double law_vent_after_s = 0.1;
  /// How long a command is valid: the valve side vents by itself unless a newer one arrives.
  double command_validity_s = 0.1;
};

/// Everything the control pipeline is built from; an experiment adds transport, simulated arm and
/// run.
struct PipelineSettings {
  ArmParameters arm;  ///< as the controller models it
  EstimationSettings estimation;
  ControllerSettings control;
  ReferenceSettings reference;
  ActuationSettings actuation;
  ActuatorInverseSettings actuator_inverse;
  SafetySettings safety;
  double rate_hz = 500.0;  ///< of the tick
};

}  // namespace softarm
