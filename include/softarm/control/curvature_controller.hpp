// The curvature controller (17).
#pragma once

#include <string>
#include <vector>

#include "softarm/control/control_law.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/control/settings.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/model_correction.hpp"

namespace softarm {

/// (17) in u,
///   tau = G(u) + C(u,u') u'_ref + B(u) u''_ref + K u_ref + K_P (u_ref - u) + D u'_ref + K_D
///   (u'_ref - u'),
/// or in the paper's polar coordinates, evaluated in u through the exact chain rule. On the model
/// it was given it leaves (18), B e'' + C e' = -(K + K_P) e - (D + K_D) e', in the chosen
/// coordinates.
///
/// Where segments stretch the same in q = (u, e), 3n numbers, three a segment: K and K_P in N/m, D and
/// K_D in N s/m along e.
class CurvatureController {
 public:
  /// Throws std::invalid_argument (expected, got) where gains do not fit the arm.
  CurvatureController(const ArmParameters& arm, const ControllerSettings& settings);

  /// How far before and after now the reference is needed (s); 0 without a valve lag to invert.
  double lookahead_s() const noexcept;

  /// u, velocity: 2n, the estimated state (rad, rad/s). O(n), no allocation. With a valve lag and a
  /// window whose interval_s > 0 it adds valve_lag d/dt FF(t) by a central difference, where FF =
  /// G(u_r) + C(u_r,u_r') u_r' + B(u_r) u_r'' + K u_r + D u_r' is what (17) asks for on the
  /// reference itself.
  /// @param correction of the model, or null; used as settings.disturbance says. Where it is exact,
  /// (18) holds for the arm that it corrects to.
  void compute(ConstVectorRef u, ConstVectorRef velocity, const ReferenceWindow& reference,
               ControlOutput& out, const ModelCorrection* correction = nullptr) noexcept;

  /// Integral action, where K_I is not zero: what it holds grows by period_s K_I (u_ref - u) and is
  /// added by compute() from then on. scale: n, the part of every segment's torque that the
  /// chambers gave; where it is below 1 the segment only lets go of what it holds.
  void integrate(double period_s, ConstVectorRef u, const ReferenceSample& reference,
                 ConstVectorRef scale) noexcept;
  /// Forgets what integrate() has gathered.
  void reset_integral() noexcept { integral_.setZero(); }
  /// What integral action holds, 2n, N m.
  const SegmentVector& integral_nm() const noexcept { return integral_; }

 private:
  template <int Width>
  void feedback_u(ConstVectorRef u, ConstVectorRef velocity, const ReferenceSample& reference,
                  ControlOutput& out) noexcept;
  void feedback_polar(ConstVectorRef u, ConstVectorRef velocity, const ReferenceSample& reference,
                      ControlOutput& out) noexcept;
  void feed_forward(const ReferenceSample& reference, SegmentVector& out) noexcept;
  void add_lag_inverse(const ReferenceWindow& reference, ControlOutput& out) noexcept;
  void add_correction(const ModelCorrection& correction, ConstVectorRef u,
                      const ReferenceSample& reference, SegmentVector& force_nm) noexcept;
  void correct(const ModelCorrection& correction, ConstVectorRef u, ConstVectorRef velocity,
               const ReferenceWindow& reference, ControlOutput& out) noexcept;

  ArmParameters arm_;
  ControllerSettings settings_;
  DynamicsWorkspace workspace_;
  SegmentVector kp_, kd_, stiffness_, damping_;
  SegmentVector velocity_ref_, acceleration_ref_, before_, after_;
  SegmentVector ki_, integral_;
  HorizontalLoad horizontal_;
  SegmentVector along_x_, along_y_;
  bool integrates_;
};

}  // namespace softarm
