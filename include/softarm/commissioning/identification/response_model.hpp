// The response of the PCC arm (16) to a recorded input for given parameters, which identification
// compares with the recorded motion.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "softarm/commissioning/identification/motion_record.hpp"
#include "softarm/config/experiment.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {

/// Everything the response depends on.
struct ArmHypothesis {
  ArmParameters arm;           ///< with the stiffness and damping used
  Eigen::Matrix2Xd input_map;  ///< input map; column j: generalized force in u, in N m, per bar (or
                               ///< N m) of input j
  std::vector<int> segment_of;  ///< of every input
  Eigen::VectorXd rest_rad;     ///< 2n: rest position of the springs
  double cubic_nm_per_rad3 = 0.0;
  bool inertia = true;       ///< false: quasi-static, u' = D^-1 (input - springs - G)
  double lag_s = 0.0;        ///< first order, from the input to the force
  double dead_time_s = 0.0;  ///< before the lag
};

/// The arm as the controller of an experiment models it, with the terms of `identification`.
ArmHypothesis configured(const Experiment& experiment);
/// The simulated arm of an experiment (`plant`).
ArmHypothesis of_plant(const Experiment& experiment);

/// f(u, p): the generalized force of the actuation, 2n, N m.
/// @param input  pressures behind the valves in bar, or moments in N m
void actuation_force(const ArmHypothesis& arm, ConstVectorRef u, const Eigen::VectorXd& input,
                     VectorRef force);

/// The spring force K (u - rest) with its cubic part, 2n, N m.
void spring_force(const ArmHypothesis& arm, ConstVectorRef u, VectorRef force);

/// Simulates (16) by the classical Runge-Kutta method with fixed steps, so that the response is a
/// smooth function of the parameters.
class ResponseModel {
 public:
  /// @param record  must outlive the model
  explicit ResponseModel(const MotionRecord& record) : record_(record) {}

  /// The longest time step, in s, with which the simulation is stable and accurate, from the
  /// fastest mode of the straight arm at rest; empty if the simulation would take too long.
  std::optional<double> step_s(const ArmHypothesis& arm) const;
  /// The same. @throws std::runtime_error if the simulation would take too long (point masses)
  double longest_step_s(const ArmHypothesis& arm) const;

  /// Simulates u at every frame (one row each, 2n columns) from the static equilibrium under the
  /// first input. False if the response grows without bound or there is no equilibrium.
  [[nodiscard]] bool simulate(const ArmHypothesis& arm, double longest_step_s,
                              Eigen::MatrixXd& u) const;

 private:
  double fastest_1ps(const ArmHypothesis& arm) const;

  const MotionRecord& record_;
};

}  // namespace softarm
