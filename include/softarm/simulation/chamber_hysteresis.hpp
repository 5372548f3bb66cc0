// Hysteresis between a chamber's pressure and the moment that it makes.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace softarm {

/// p_acting = (1 - h) p + h / m sum_k play_k(p), with m play operators a chamber. While commands
/// are held pressures are monotone, so p_acting is exact at any time ahead of the last `remember`.
class ChamberHysteresis {
 public:
  /// @param part h in [0, 1]  @param half_width_bar of the m operators, >= 0; none: p_acting = p
  /// @param chambers >= 0, all start at 0 bar
  ChamberHysteresis(double part, const std::vector<double>& half_width_bar, int chambers);

  bool active() const noexcept { return part_ > 0.0 && half_width_bar_.size() > 0; }

  /// Replaces pressures by those that act.
  void apply(Eigen::Ref<Eigen::VectorXd> pressure_bar) const noexcept;

  /// The pressures (bar) have come to this, each without turning back since the last call.
  void remember(const Eigen::VectorXd& pressure_bar) noexcept;

 private:
  double part_;
  Eigen::VectorXd half_width_bar_;  // m
  Eigen::MatrixXd output_bar_;      // m x chambers
};

}  // namespace softarm
