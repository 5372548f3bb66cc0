// The piecewise constant curvature arm as a second-order system: (16) with a tip force, behind
// valves.
#pragma once

#include <Eigen/Core>

#include "plant/second_order_system.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/plant/settings.hpp"

namespace softarm {

/// r = B u'' + C u' + D u' + G + K u - A tau_A(t) - J' f_ext. The actuation is given in the
/// chambers' own terms: the generalized force that A_chamber would make of it, decaying
/// exponentially from one value to another as the valves do.
class PccSystem final : public SecondOrderSystem {
 public:
  explicit PccSystem(const PlantSettings& settings);

  /// From t_s on, the chambers' force is target + (present - target) exp(-(t - t_s) / lag_s); lag
  /// 0: target.
  void drive(double t_s, ConstVector present_nm, ConstVector target_nm, double lag_s);

  int size() const override { return arm_.dof(); }
  void residual(double t_s, ConstVector u, ConstVector velocity, ConstVector acceleration,
                Vector out) override;
  bool acceleration(double t_s, ConstVector u, ConstVector velocity, Vector out) override;
  void linearize(double t_s, ConstVector u, ConstVector velocity, ConstVector acceleration,
                 Matrix by_acceleration, Matrix by_velocity, Matrix by_u) override;
  Powers powers(double t_s, ConstVector u, ConstVector velocity) override;

  double kinetic_energy_j(ConstVector u, ConstVector velocity);
  double potential_energy_j(
      ConstVector u) const;  ///< gravity (zero at the world's origin) and bending

 private:
  /// out += A tau_A(t) + J' f_ext.
  void add_input(double t_s, ConstVector u, Vector out);
  const Eigen::VectorXd& chamber_force(double t_s);

  ArmParameters arm_;
  Eigen::Vector3d tip_force_n_;
  bool has_tip_force_;
  DynamicsWorkspace workspace_;
  Eigen::VectorXd stiffness_, damping_;  // diagonals of K and D
  Eigen::VectorXd target_nm_, excess_nm_;
  double since_s_ = 0.0;
  double rate_per_s_ = 0.0;  // 1 / lag, or 0 for a force that does not change
  double force_time_s_ = 0.0;
  bool force_known_ = false;
  Eigen::VectorXd force_nm_;                       // at force_time_s_
  Eigen::VectorXd shifted_, above_, below_, sum_;  // scratch
  Eigen::MatrixXd coriolis_;
};

}  // namespace softarm
