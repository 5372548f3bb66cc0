// What the valves do to an arm between two changes of the command: a force in closed form.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "softarm/simulation/second_order_system.hpp"

namespace softarm {

class ChamberHysteresis;
class Valves;

/// The generalized force A_chamber tau_A of every segment (2n, N m; 3n with the axial forces in N
/// where segments stretch), decaying exponentially from one value to another as pressures behind
/// valves do.
class ActuatorInput {
 public:
  using ConstVector = SecondOrderSystem::ConstVector;

  explicit ActuatorInput(int dof)
      : target_nm_(Eigen::VectorXd::Zero(dof)), excess_nm_(target_nm_), force_nm_(target_nm_) {}

  /// From t_s on: target + (present - target) exp(-(t - t_s) / lag_s); lag 0: target.
  void drive(double t_s, ConstVector present_nm, ConstVector target_nm, double lag_s) {
    target_nm_ = target_nm;
    excess_nm_ = present_nm - target_nm;
    since_s_ = t_s;
    rate_per_s_ = lag_s > 0.0 ? 1.0 / lag_s : 0.0;
    valves_ = nullptr;
    known_ = false;
  }

  /// From t_s on: `map` times the pressures that `valves`, as they stand then, come to, as they act
  /// behind `hysteresis`. All outlive this and do not change until the next call.
  void follow(double t_s, const Valves& valves, const ChamberHysteresis& hysteresis,
              const Eigen::MatrixXd& map);

  /// The chambers' pressures (bar), if it follows valves.
  const Eigen::VectorXd& pressures_bar(double t_s) {
    if (valves_ != nullptr) force_of_valves_nm(t_s);
    return pressures_bar_;
  }

  const Eigen::VectorXd& force_nm(double t_s) {
    if (valves_ != nullptr) return force_of_valves_nm(t_s);
    if (!known_ || (rate_per_s_ > 0.0 && t_s != time_s_)) {
      force_nm_ = target_nm_;
      if (rate_per_s_ > 0.0) {
        force_nm_ += std::exp(-(t_s - since_s_) * rate_per_s_) * excess_nm_;
      }
      time_s_ = t_s;
      known_ = true;
    }
    return force_nm_;
  }

  /// tau_A of segment i of an arm that does not stretch: the moments about its x and y axes.
  Eigen::Vector2d tau_nm(double t_s, Eigen::Index i) {
    const Eigen::VectorXd& force = force_nm(t_s);
    return {-force[2 * i + 1], force[2 * i]};
  }

 private:
  const Eigen::VectorXd& force_of_valves_nm(double t_s);

  Eigen::VectorXd target_nm_, excess_nm_;
  Eigen::VectorXd force_nm_;        // at time_s_
  const Valves* valves_ = nullptr;  // where they are not one exponential
  const ChamberHysteresis* hysteresis_ = nullptr;
  const Eigen::MatrixXd* map_ = nullptr;
  Eigen::VectorXd pressures_bar_, acting_bar_;
  double since_s_ = 0.0;
  double rate_per_s_ = 0.0;  // 1 / lag, or 0 for a force that does not change
  double time_s_ = 0.0;
  bool known_ = false;
};

}  // namespace softarm
