// How far the measured tip is off the model's: what (21) needs to know of the real arm.
#pragma once

#include <Eigen/Core>

#include "softarm/control/inverse_kinematics.hpp"

namespace softarm {

/// The offset d = p - f(u_ref) of the measured tip p from the model's tip of the reference, fitted as
///   d(t) = line(t) + M x(t),   x the path (from the base) at that time.
/// M catches what belongs to the place (wrong length, payload, wrong stiffness), the line what
/// drifts. M may be learnt slowly, and yet what it predicts moves as fast as the path does: so the
/// feedback over the arm can stay slower than the arm's own modes. A Kalman filter whose line has
/// white acceleration. The variance of M is bounded by its prior: a long stay in one place makes
/// nothing of noise. No allocation. Times in s, one clock.
class TipOffset {
 public:
  /// @param bandwidth_radps of the line @param map_rate_1ps at which M follows; 0: M = 0
  /// @param reach_m length of the arm
  TipOffset(double bandwidth_radps, double map_rate_1ps, double reach_m) noexcept;

  /// Forgets all; d is offset_m at time_s.
  void start(double time_s, const Eigen::Vector3d& offset_m) noexcept;

  /// d as measured at time_s, where the path was at path_m. Not later than the last one: ignored.
  void measure(double time_s, const Eigen::Vector3d& offset_m,
               const Eigen::Vector3d& path_m) noexcept;

  /// d and its derivatives at time_s. Without measurements for 0.1 s the line rests.
  TipReference at(double time_s, const TipReference& path) const noexcept;

 private:
  static constexpr int kStates = 5;  ///< value and rate of the line, a row of M
  using Row = Eigen::Matrix<double, kStates, 1>;

  void predict(double passed_s) noexcept;

  double bandwidth_, map_drift_, reach_m_;
  double time_s_ = 0.0;
  Eigen::Matrix<double, 3, kStates> fit_;           ///< a row an axis
  Eigen::Matrix<double, kStates, kStates> spread_;  ///< covariance, the same for every axis
};

}  // namespace softarm
