// What an experiment may choose about control: the law, its gains, its terms and the reference it
// follows.
// config/template.yaml documents every setting.
#pragma once

#include <optional>
#include <vector>

#include "softarm/control/control_law.hpp"
#include "softarm/control/reference_kinds.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// Coordinates of the control law.
enum class ControlCoordinates {
  u,     ///< the controller (17) in u: smooth everywhere
  polar  ///< (17) in the paper's (phi, theta) with gains such as (23)
};

/// The terms of (17) that are evaluated; one that is left out costs nothing.
struct ControlTerms {
  bool inertia = true;
  bool coriolis = true;
  bool gravity = true;
  bool stiffness = true;
  bool damping = true;
};

/// How a path of the tip becomes a motion of the segments: (21) as corrected, second order.
struct TaskSpaceSettings {
  double lambda_1ps = 6.0;
  double tip_bandwidth_radps = 3.0;
  double posture_rate_1ps = 2.0;
  double map_rate_1ps = 1.0;
};

/// What (17) makes of what the model-based observer found; nothing where there is none.
enum class DisturbanceRejection {
  cancel,      ///< corrected parameters, and the estimated disturbance is cancelled: no offset, and
               ///< the arm gives way to nothing that lasts
  model_only,  ///< corrected parameters: the arm stays as soft as K + K_P
  none         ///< the configured model
};

/// What repeats along a periodic reference is learnt and compensated ahead (RepetitiveCompensation).
struct RepetitionSettings {
  double lead_s = 0.0;                  ///< 0: it is not
  std::optional<double> period_s = {};  ///< none: that of the reference's phase
};

/// The controller (17): its terms, gains and limits.
struct ControllerSettings {
  LawKind law;  ///< what follows belongs to `curvature` and `statics_pi`, limits apart
  ControlCoordinates coordinates = ControlCoordinates::u;
  ControlTerms terms;
  /// Diagonals of K_P (N m/rad) and K_D (N m s/rad), two numbers a segment: [u_x, u_y] or [phi,
  /// theta].
  std::vector<double> kp;
  std::vector<double> kd;
  /// Diagonal of an integral gain on u_ref - u (N m/(rad s)), in u whatever the coordinates; not in
  /// the paper. Empty or zero: none, at no cost.
  std::vector<double> ki;
  /// The same along e of segments that stretch, one a segment: N/m, N s/m, N/(m s). Empty: zero.
  std::vector<double> kp_axial, kd_axial, ki_axial;
  DisturbanceRejection disturbance = DisturbanceRejection::cancel;
  RepetitionSettings repetition;
  double valve_lag_s = 0.0;
  double dead_time_s = 0.0;
  double max_theta_rad = 2.5;
  double max_speed_radps = 20.0;
  double max_step_rad = 0.2;
  double blend_s = 1.0;
  double polar_theta_min_rad = 0.05;
  TaskSpaceSettings task_space;
};

/// The elongation of every segment that stretches, mean + amplitude sin(rate t), t since the phase
/// began.
struct ElongationPath {
  std::optional<double> mean_m = {};  ///< none: the natural elongation
  double amplitude_m = 0.0;
  double rate_radps = 0.0;
};

/// One phase of a sequence; the last one has no end.
struct ReferencePhase {
  ReferenceKind kind;
  double duration_s = 0.0;  ///< ignored for the last phase
  /// Of a phase that gives curvatures: what it asks of segments that stretch. It is followed as far
  /// as pressures can (ElongationReference).
  ElongationPath elongation = {};
};

/// What the arm is to follow: phases, one after the other.
struct ReferenceSettings {
  std::vector<ReferencePhase> phases;
};

}  // namespace softarm
