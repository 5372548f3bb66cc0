// The response of the PCC arm (16) to a recorded input, with parameters that may be wrong: what
// identification compares with the recorded motion.
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
  ArmParameters arm;            ///< its stiffness and damping count
  Eigen::Matrix2Xd push;        ///< column j: generalized force in u of input j a bar (or N m), N m
  std::vector<int> segment_of;  ///< of every input
  Eigen::VectorXd rest_rad;     ///< 2n: where the springs rest
  double cubic_nm_per_rad3 = 0.0;
  bool inertia = true;  ///< false: damping alone resists motion, u' = D^-1 (push - springs - G)
  double lag_s = 0.0;   ///< first order, from the input to what pushes
  double dead_time_s = 0.0;  ///< before that
};

/// What the controller of an experiment believes, with the terms of `identification`.
ArmHypothesis believed(const Experiment& experiment);
/// What its simulated arm is.
ArmHypothesis of_plant(const Experiment& experiment);

/// f(u, p): the generalized force of what acts behind the valves, 2n, N m.
void push_force(const ArmHypothesis& arm, ConstVectorRef u, const Eigen::VectorXd& input,
                VectorRef force);

/// K (u - rest) and its cubic part, 2n, N m.
void spring_force(const ArmHypothesis& arm, ConstVectorRef u, VectorRef force);

/// Simulates (16) by the classical Runge-Kutta method with fixed steps, so that the response is a
/// smooth function of the parameters.
class ResponseModel {
 public:
  explicit ResponseModel(const MotionRecord& record) : record_(record) {}

  /// The longest step with which the arm is stable and accurate, from its fastest mode straight and
  /// at rest; nothing where that would take too long.
  std::optional<double> step_s(const ArmHypothesis& arm) const;
  /// The same. @throws std::runtime_error where that would take too long (point masses)
  double longest_step_s(const ArmHypothesis& arm) const;

  /// u at every frame, in rows, from the static equilibrium under the first input. False where the
  /// response grows without bound or there is no equilibrium.
  [[nodiscard]] bool simulate(const ArmHypothesis& arm, double longest_step_s,
                              Eigen::MatrixXd& u) const;

 private:
  double fastest_1ps(const ArmHypothesis& arm) const;

  const MotionRecord& record_;
};

}  // namespace softarm
