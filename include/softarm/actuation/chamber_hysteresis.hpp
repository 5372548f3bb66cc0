// Hysteresis between a chamber's pressure and the moment that it makes, and its inverse.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace softarm {

/// p_acting = p + sum_k w_k (play_k(p) - p), with m play operators a chamber: the model of
/// Prandtl and Ishlinskii, h = sum_k w_k. While commands are held pressures are monotone, so p_acting is exact at
/// any time ahead of the last `remember`.
class ChamberHysteresis {
 public:
  /// @param part h in [0, 1], w_k = h / m  @param half_width_bar of the m operators, >= 0; none: p_acting = p
  /// @param chambers >= 0, all start at 0 bar
  ChamberHysteresis(double part, const std::vector<double>& half_width_bar, int chambers);

  bool active() const noexcept { return active_; }

  /// What acts of a chamber (from 0) that has come to this pressure, bar.
  double acting(Eigen::Index chamber, double pressure_bar) const noexcept;

  /// The pressure of a chamber at which `acting_bar` acts: the inverse of acting(), exact, m^2
  /// operations. It is monotone with a slope of 1 to 1 / (1 - h), so h < 1. That it is taken from
  /// what is remembered makes it the inverse operator of Krejci and Kuhnen (2001).
  double pressure(Eigen::Index chamber, double acting_bar) const noexcept;

  /// Replaces pressures by those that act.
  void apply(Eigen::Ref<Eigen::VectorXd> pressure_bar) const noexcept;

  /// The pressures (bar) have come to this, each without turning back since the last call.
  void remember(Eigen::Ref<const Eigen::VectorXd> pressure_bar) noexcept;

  /// play_k(p) - p of an operator and a chamber, bar: of what its weight is a factor.
  double slack(Eigen::Index k, Eigen::Index chamber, double pressure_bar) const noexcept;
  /// w, m numbers >= 0 whose sum is below 1; with any, it is active.
  void set_weights(Eigen::Ref<const Eigen::VectorXd> weight) noexcept;
  const Eigen::VectorXd& weights() const noexcept { return weight_; }

 private:
  bool active_;
  Eigen::VectorXd weight_;          // m
  Eigen::VectorXd half_width_bar_;  // m
  Eigen::MatrixXd output_bar_;      // m x chambers
};

}  // namespace softarm
