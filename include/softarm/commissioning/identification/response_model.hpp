// The response of the PCC arm (16) to a recorded input for given parameters, which identification
// compares with the recorded motion.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "softarm/commissioning/identification/motion_record.hpp"
#include "softarm/config/experiment.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/memory.hpp"

namespace softarm {

/// How the segments stretch: the length of segment i follows
/// offset_i + sum over chambers j of gain_ij p_j (1 + curved_ij p_j) behind the chambers' lag.
struct ElongationHypothesis {
  Eigen::VectorXd offset_m;          ///< n: the length without pressure
  Eigen::MatrixXd gain_m_per_bar;    ///< n x inputs
  std::vector<FillVentLag> lags;     ///< of every input
  Eigen::VectorXd saturation_1pbar;  ///< of every input
  double friction_m = 0.0;           ///< half width of a play between pressure and length
  Remanence remanence, remanence_2;  ///< of the length beyond the offset, share of it
  /// Of the largest stretch by pressure so far, this part stays: the set that a fresh arm takes.
  double set = 0.0;
  double by_bend_m_per_rad2 = 0.0;  ///< what a bend adds, by |u|^2; negative: bent it is shorter

  bool given() const { return offset_m.size() > 0; }
};

/// Everything the response depends on. What is zero or empty is left out and costs nothing.
struct ArmHypothesis {
  ArmParameters arm;           ///< with the stiffness and damping used
  Eigen::Matrix2Xd input_map;  ///< input map; column j: generalized force in u, in N m, per bar (or
                               ///< N m) of input j
  std::vector<int> segment_of;  ///< of every input
  Eigen::VectorXd rest_rad;     ///< 2n: rest position of the springs
  double cubic_nm_per_rad3 = 0.0;
  bool inertia = true;       ///< false: quasi-static, u' = D^-1 (input - springs - G)
  double load_kg = 0.0;      ///< a point mass at the tip
  double lag_s = 0.0;        ///< first order, from the input to the force
  double dead_time_s = 0.0;  ///< before the lag
  /// Of every input, instead of lag_s: filling and venting. Empty: lag_s for both.
  std::vector<FillVentLag> lags;
  /// Of every input: p counts as p (1 + saturation p). Negative where it saturates.
  Eigen::VectorXd saturation_1pbar;
  double stiffening_1pbar = 0.0;  ///< k counts as k (1 + s sum of the segment's pressures)
  /// k counts as k (l / L)^this, l by `elongation`, L as configured: what is stretched is taut.
  double stiffening_by_length = 0.0;
  Eigen::MatrixXd cross_nm_per_bar;  ///< 2n x inputs: forces on segments that a chamber is not in
  std::vector<SlipSpring> slip_springs;  ///< hysteresis, alike in every segment
  Remanence remanence;                   ///< of the rest, alike in every segment
  Eigen::VectorXd remanent_rad;          ///< 2n: its state when the record begins
  Remanence remanence_2;                 ///< the same with another time; 0 when the record begins
  ElongationHypothesis elongation;

  /// The lag of every input.
  std::vector<FillVentLag> input_lags() const;
  /// Whether the bend depends on what was before, beyond (16).
  bool remembers() const {
    return !slip_springs.empty() || remanence.share != 0.0 || remanence_2.share != 0.0;
  }
};

/// The arm as the controller of an experiment models it, with the terms of `identification`.
ArmHypothesis configured(const Experiment& experiment);
/// The simulated arm of an experiment (`plant`).
ArmHypothesis of_plant(const Experiment& experiment);

/// f(u, p): the generalized force of the actuation, 2n, N m.
/// @param input  pressures behind the valves in bar, or moments in N m
void actuation_force(const ArmHypothesis& arm, ConstVectorRef u, const Eigen::VectorXd& input,
                     VectorRef force);

/// What the load at the tip adds to G(u) of (16), to `out` (2n, N m): -m J' g.
void add_load_moments(const ArmHypothesis& arm, ConstVectorRef u, VectorRef out);

/// The spring force K (u - rest) with its cubic part, 2n, N m.
void spring_force(const ArmHypothesis& arm, ConstVectorRef u, VectorRef force);

/// Simulates (16) with fixed steps, so that the response is a smooth function of the parameters: by
/// the classical Runge-Kutta method, or, without inertia, by an implicit one that is stable for any
/// damping down to none (`QuasiStaticMotion`).
class ResponseModel {
 public:
  /// @param record  must outlive the model
  explicit ResponseModel(const MotionRecord& record) : record_(record) {}

  /// The longest time step, in s, with which the simulation is stable and accurate: from the
  /// fastest mode of the straight arm at rest, or what the input asks for without inertia; empty if
  /// the simulation would take too long.
  std::optional<double> step_s(const ArmHypothesis& arm) const;
  /// The same. @throws std::runtime_error if the simulation would take too long (point masses)
  double longest_step_s(const ArmHypothesis& arm) const;

  /// Simulates u at every frame (one row each, 2n columns) from the static equilibrium under the
  /// first input. False if the response grows without bound or there is no equilibrium.
  [[nodiscard]] bool simulate(const ArmHypothesis& arm, double longest_step_s,
                              Eigen::MatrixXd& u) const;

  /// The lengths by arm.elongation, for a bend that is simulated.
  KnownLengths lengths_of(const ArmHypothesis& arm) const;
  /// The length of every segment at every frame (n columns), m, by arm.elongation. @param u_rad  of
  /// every frame, 2n columns: as simulated, where lengths are predicted
  void simulate_lengths(const ArmHypothesis& arm, const Eigen::MatrixXd& u_rad,
                        Eigen::MatrixXd& length_m) const;

 private:
  double fastest_1ps(const ArmHypothesis& arm) const;
  KnownLengths stretching(const ArmHypothesis& arm) const;  ///< empty: stiffness does not follow it
  [[nodiscard]] bool simulate_motion(const ArmHypothesis& arm, double longest_step_s,
                                     Eigen::MatrixXd& u) const;
  [[nodiscard]] bool simulate_balance(const ArmHypothesis& arm, double longest_step_s,
                                      Eigen::MatrixXd& u) const;

  const MotionRecord& record_;
};

}  // namespace softarm
