// The links once more, in the paper's pair of angles: to see what these cost.
#pragma once

#include <Eigen/Core>

#include "simulation/link_system.hpp"

namespace softarm {

/// LinkSystem in q = [phi_1, theta_1, ...] with (a, b) = theta (-sin phi, cos phi): r_q = P' r. A
/// straight joint has no inertia, no damping and no force in phi; the least that keeps B definite
/// there is added: a rotor on phi of kRotor times the link's m l^2 / 3, and nothing else. A joint
/// that is exactly straight bends only in the direction phi that it has, whatever the moment.
class PolarLinkSystem final : public LinkSystem {
 public:
  explicit PolarLinkSystem(const PlantSettings& settings);

  static constexpr double kRotor = 1e-6;

  void residual(double t_s, ConstVector q, ConstVector v, ConstVector a, Vector out) override;
  bool acceleration(double t_s, ConstVector q, ConstVector v, Vector a) override;
  void linearize(double t_s, ConstVector q, ConstVector v, ConstVector a, Matrix by_a, Matrix by_v,
                 Matrix by_q) override;
  Powers powers(double t_s, ConstVector q, ConstVector v) override;
  double kinetic_energy_j(ConstVector q, ConstVector v) override;
  double potential_energy_j(ConstVector q) override;
  void spread(ConstVector u, Vector q) const override;
  void spread_rate(ConstVector u, ConstVector rate, Vector v) const override;
  void segment_ends(ConstVector q, std::span<Eigen::Isometry3d> ends) const override;
  void curvature(ConstVector q, ConstVector v, Vector u, Vector rate) const override;

 private:
  Eigen::Index links() const { return size() / 2; }
  Eigen::VectorXd angles(ConstVector q) const;                      // (a, b) of every link
  Eigen::VectorXd angle_rates(ConstVector q, ConstVector v) const;  // P v

  Eigen::VectorXd rotor_;  // added inertia of phi, one a link
  Eigen::VectorXd crossed_, crossed_rate_, crossed_acceleration_, shifted_, above_, below_;
  Eigen::MatrixXd inertia_, unused_;
};

}  // namespace softarm
