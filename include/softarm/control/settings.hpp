// What an experiment may choose about control: the law, its gains, its terms and the reference it
// follows.
// config/template.yaml documents every setting.
#pragma once

#include <Eigen/Core>
#include <string>
#include <variant>
#include <vector>

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
  double tip_bandwidth_radps = 10.0;
  double posture_rate_1ps = 2.0;
};

/// What (17) makes of what the model-based observer found; nothing where there is none.
enum class DisturbanceRejection {
  cancel,      ///< corrected parameters, and the estimated disturbance is cancelled: no offset, and
               ///< the arm gives way to nothing that lasts
  model_only,  ///< corrected parameters: the arm stays as soft as K + K_P
  none         ///< the configured model
};

/// The controller (17): its terms, gains and limits.
struct ControllerSettings {
  ControlCoordinates coordinates = ControlCoordinates::u;
  ControlTerms terms;
  /// Diagonals of K_P (N m/rad) and K_D (N m s/rad), two numbers a segment: [u_x, u_y] or [phi,
  /// theta].
  std::vector<double> kp;
  std::vector<double> kd;
  /// Diagonal of an integral gain on u_ref - u (N m/(rad s)), in u whatever the coordinates; not in
  /// the paper. Empty or zero: none, at no cost.
  std::vector<double> ki;
  DisturbanceRejection disturbance = DisturbanceRejection::cancel;
  double valve_lag_s = 0.0;
  double dead_time_s = 0.0;
  double max_theta_rad = 2.5;
  double max_speed_radps = 20.0;
  double max_step_rad = 0.2;
  double blend_s = 1.0;
  double polar_theta_min_rad = 0.05;
  TaskSpaceSettings task_space;
};

/// Hold u constant.
struct SetPointReference {
  std::vector<double> u_rad;  ///< 2n
};

/// The paper's (24): theta rises to `theta_rad` in `rise_s`, phi_i = phi_centre + phi_amplitude
/// cos(rate t + (i-1) phase).
struct PaperReference {
  double theta_rad = 0.4;
  double rise_s = 1.0;
  double phi_centre_rad = 3.141592653589793;
  double phi_amplitude_rad = 1.0;
  double rate_radps = 2.0;
  double phase_step_rad = 1.0471975511965976;
};

/// Where the arm is to be at a time of the phase.
struct WayPoint {
  double time_s = 0.0;
  std::vector<double> u_rad;  ///< 2n
};
/// Smooth motion through way points: minimum-jerk (quintic) pieces, at rest in every point.
struct WayPointReference {
  std::vector<WayPoint> points;
  bool repeat = false;
};

/// References received over LCM; until one arrives, the arm holds where it is.
struct LiveReference {
  double timeout_s = 0.2;
};

/// Path p_d(t) of the tip in the world.
enum class TipPathShape {
  point,      ///< p_d = centre
  circle,     ///< p_d = centre + first_axis cos(rate t) + second_axis sin(rate t); an ellipse
  lemniscate  ///< p_d = centre + first_axis cos(rate t) + second_axis sin(2 rate t)
};

/// Where the tip should be, in the world frame; the defaults are the paper's lemniscate (22).
struct TipPathReference {
  TipPathShape shape = TipPathShape::lemniscate;
  Eigen::Vector3d centre_m = Eigen::Vector3d(-0.25, 0.0, -0.5);
  Eigen::Vector3d first_axis_m = Eigen::Vector3d(0.0, 1.0 / 3.0, 0.0);
  Eigen::Vector3d second_axis_m = Eigen::Vector3d(0.0, 0.0, 1.0 / 6.0);
  double rate_radps = 0.6283185307179586;
};

using ReferenceKind = std::variant<SetPointReference, PaperReference, WayPointReference,
                                   LiveReference, TipPathReference>;

/// One phase of a sequence; the last one lasts for ever.
struct ReferencePhase {
  ReferenceKind kind;
  double duration_s = 0.0;  ///< ignored for the last phase
};

/// What the arm is to follow: phases, one after the other.
struct ReferenceSettings {
  std::vector<ReferencePhase> phases;
};

}  // namespace softarm
