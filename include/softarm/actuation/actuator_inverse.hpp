// Set points for chambers that fill and vent at different rates, act with hysteresis, and stiffen the
// arm: what makes them act as a linear lag would on the pressures that a control law asks for.
//
//   inverse.advance(passed_s, sent_bar);                      // what the last set points did
//   inverse.allocate(allocator, tau_nm, motion, allocation);   // set points for a torque
//   inverse.sent(allocator, limited_bar, motion, tau_nm);      // the torque that was sent, in effect
//   inverse.learn(disturbance_nm, ...);                        // what the observer leaves over
#pragma once

#include <vector>

#include "softarm/actuation/chamber_hysteresis.hpp"
#include "softarm/actuation/fill_vent_lag.hpp"
#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/actuation/settings.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/chambers.hpp"
#include "softarm/model/memory.hpp"

namespace softarm {

/// Of every chamber it models the pressure y behind its lag, y' = (set point - y) / T with T for
/// rising or falling, and what acts of it, a = H(y), by play operators. A linear actuator with the lag
/// T_0 that is asked for p would bring a to a + (p - a)(1 - exp(-dt / T_0)) by the end of a period
/// dt. The set point that does the same here follows in closed form, through the inverse of H and that
/// of the lag:
///
///   y* = H^-1(a + (p - a)(1 - exp(-dt / T_0))),   set point = y + (y* - y) / (1 - exp(-dt / T)).
///
/// It is continuous and monotone in p, with slopes of at most T / T_0 / (1 - h). It starts from the
/// modelled state, which follows from what was sent after limits and slew: it does not wind up, and
/// contains no measurement. Controller and observer see an actuator with the lag T_0.
///
/// What a chamber cannot give, as it vents more slowly than asked, or still acts where it is vented, is
/// asked of the others: a fixed number of steps tau <- tau + (asked - effective torque). So is
/// stiffening, K (1 + s sum p), which takes s sum(p) K u_ref from the torque, and springs that slip
/// (SlipSpring), which take what they oppose to the reference; both with T_0 times their rate, as the
/// lag T_0 is inverted.
///
/// Learning: the disturbance that a model-based observer finds is that of the weights' errors,
/// d = sum_k (w_true - w)_k phi_k, with phi_k the force of the chambers' slack; without the slow parts
/// of both, normalised least mean squares follow, within w_k >= 0 and a largest sum.
///
/// No allocation, no exception and no clock after construction.
class ActuatorInverse {
 public:
  /// What the arm is asked to do, and where it is; 2n each, 3n where segments stretch.
  struct Motion {
    const SegmentVector& u_rad;
    const SegmentVector& reference_rad;
    const SegmentVector& reference_velocity_radps;
  };

  /// @param valve_lag_s T_0  @param period_s for which a set point is held
  /// @throws std::invalid_argument (expected, got) for settings that cannot be inverted
  ActuatorInverse(const ArmParameters& arm, const ActuationSettings& actuation,
                  const ActuatorInverseSettings& settings, double valve_lag_s, double period_s);

  /// Set points were in force for so long.
  void advance(double passed_s, const PressureVector& set_point_bar) noexcept;
  /// The arm begins to follow a reference: weights are learnt along it. They are kept.
  void start() noexcept;
  /// All chambers are vented.
  void reset() noexcept;

  /// tau_A (2n, N m; 3n where segments stretch) as PressureAllocator::allocate does, but set points.
  void allocate(const PressureAllocator& allocator, ConstVectorRef tau_nm, const Motion& motion,
                Allocation& out) noexcept;

  /// These set points are sent, after limits. Gives tau_A of the linear actuator, on the arm without
  /// stiffening and slip, which does what they do: where they are those of allocate(), its torque.
  void sent(const PressureAllocator& allocator, const PressureVector& set_point_bar,
            const Motion& motion, VectorRef tau_nm) noexcept;

  /// After sent(), where weights are learnt: d (generalized force, 2n, N m) and whether it may be
  /// taken for hysteresis now.
  void learn(const PressureAllocator& allocator, ConstVectorRef u_rad,
             ConstVectorRef disturbance_nm, bool may) noexcept;
  bool learns() const noexcept { return learns_; }
  /// w of the play operators.
  const Eigen::VectorXd& weights() const noexcept { return hysteresis_.weights(); }

  /// y, bar.
  const PressureVector& modelled_pressure_bar() const noexcept { return pressure_bar_; }

 private:
  /// Of a chamber: 1 - exp(-dt / T) over a period.
  struct Approach {
    double fill, vent;
    double towards(double input, double state) const noexcept {
      return input > state ? fill : vent;
    }
  };

  double set_point(Eigen::Index chamber, double asked_bar) const noexcept;
  void effective_torque(const PressureAllocator& allocator, const PressureVector& set_point_bar,
                        const Motion& motion, VectorRef tau_nm) noexcept;
  void take_material(const Motion& motion, const PressureVector& asked_bar,
                     VectorRef tau_nm) noexcept;

  ArmParameters arm_;
  std::vector<int> chambers_;  ///< of every segment
  double min_bar_, max_bar_;
  double stiffening_per_bar_;
  bool changes_torque_;  ///< by stiffening or slip
  bool learns_;
  double period_s_;
  double target_lag_s_;
  double target_approach_;
  std::vector<FillVentLag> lag_;
  std::vector<Approach> approach_;
  ChamberHysteresis hysteresis_;
  PressureVector pressure_bar_;  ///< y
  PressureVector acting_bar_;    ///< a
  PressureVector asked_bar_;     ///< scratch: p
  SegmentVector tau_nm_, force_nm_, effective_nm_, material_nm_;
  std::vector<SlipSpring> spring_;  ///< beside K of every segment
  Eigen::Matrix2Xd centre_;         ///< of every segment's springs, in turn
  // Learning: means over kForget_s, m or 2n numbers.
  Eigen::MatrixXd slack_nm_, mean_slack_nm_;  ///< phi, 2n x m
  SegmentVector mean_disturbance_nm_;
  Eigen::VectorXd next_weight_;
  double power_nm2_ = 0.0, least_power_nm2_ = 0.0;
  double learning_s_ = 0.0;
};

}  // namespace softarm
