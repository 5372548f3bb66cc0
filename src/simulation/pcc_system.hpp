// The piecewise constant curvature arm as a second-order system: (16) with what the world does to
// it, behind valves; one piece a segment or several.
#pragma once

#include <Eigen/Core>

#include "simulation/pcc_loads.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/memory.hpp"
#include "softarm/simulation/plant_system.hpp"
#include "softarm/simulation/settings.hpp"

namespace softarm {

/// r = B u'' + C u' + D u' + G + K u - A tau_A(t) - J' f_ext, where u are the curvatures of all
/// pieces: the kinds pcc and refined. Of an arm that is extensible (u, e) of all pieces; r is NaN
/// where one would have no length left. `MaterialSettings` add to K u of one-piece segments;
/// what relaxes is held while a step is made. The moment of a segment's chambers follows
/// the body and acts on each of its pieces alike; the paper's couple has fixed axes, those of the
/// segment's start, and acts between there and the segment's end.
class PccSystem final : public PlantSystem {
 public:
  /// @param arm of pieces, `pieces` a segment.
  PccSystem(const PlantSettings& settings, const ArmParameters& arm, int pieces);

  int size() const override { return arm_.dof(); }
  double unit(Eigen::Index i) const override;  ///< of e: the segment's length at rest
  void residual(double t_s, ConstVector u, ConstVector velocity, ConstVector acceleration,
                Vector out) override;
  bool acceleration(double t_s, ConstVector u, ConstVector velocity, Vector out) override;
  void linearize(double t_s, ConstVector u, ConstVector velocity, ConstVector acceleration,
                 Matrix by_acceleration, Matrix by_velocity, Matrix by_u) override;
  Powers powers(double t_s, ConstVector u, ConstVector velocity) override;

  double kinetic_energy_j(ConstVector u, ConstVector velocity) override;
  double potential_energy_j(ConstVector u) override;
  void spread(ConstVector u, Vector x) const override;
  void segment_ends(ConstVector x, std::span<Eigen::Isometry3d> ends) const override;
  void curvature(ConstVector x, ConstVector v, Vector u, Vector rate) const override;
  PlantShape shape(ConstVector x) const override { return arcs(arm_, x); }
  bool remembers() const override { return !maxwell_.empty() || material_.bouc_wen > 0.0; }
  void remember(double passed_s, ConstVector u) override;

 private:
  /// A base that accelerates is gravity the other way.
  void feel_base(double t_s);
  /// out += A tau_A(t) + J' f_ext.
  void add_input(double t_s, ConstVector u, Vector out);
  void add_couple(const Eigen::Vector2d& tau_nm, int first_piece, ConstVector u, Vector out) const;
  bool has_lengths(ConstVector u) const;
  /// A spring behind a dashpot beside K, in every coordinate: its force is stiffness (u - relaxed).
  struct MaxwellElement {
    Eigen::VectorXd stiffness, relaxed;
    double time_s;
  };
  std::vector<MaxwellElement> maxwell_elements() const;
  /// out -= what the material adds to K u, but for its cubic part: work done on the arm.
  void add_material(double t_s, ConstVector u, Vector out);
  /// z of Bouc and Wen of a segment that has come to this bend.
  Eigen::Vector2d yielded(int segment, const Eigen::Vector2d& bend) const;
  /// out += K cubic |u|^2 u.
  void add_cubic(ConstVector u, Vector out) const;
  double cubic_energy_j(ConstVector u) const;

  int segments_;
  int pieces_;                      // a segment
  int width_;                       // coordinates a piece
  std::vector<Eigen::Index> held_;  // e of segments of constant length in an extensible arm
  ArmParameters arm_;               // of pieces
  Eigen::VectorXd share_;           // of a segment's bend under a uniform moment, one a piece
  Eigen::Vector3d gravity_mps2_;    // without the base's acceleration
  PccLoads loads_;
  MaterialSettings material_;
  bool bends_otherwise_;
  Eigen::MatrixXd segment_sum_;  // n x chambers, ones where a chamber is the segment's
  Eigen::VectorXd pressure_sum_bar_;
  std::vector<MaxwellElement> maxwell_;  // empty: none
  BoucWen bouc_wen_;
  Eigen::VectorXd yielded_rad_, yielded_at_rad_;  // z of Bouc and Wen, and u of that
  DynamicsWorkspace workspace_;
  Eigen::VectorXd stiffness_, damping_;            // diagonals of K and D
  Eigen::VectorXd shifted_, above_, below_, sum_;  // scratch
  Eigen::MatrixXd coriolis_, inertia_;
  mutable std::vector<Eigen::Isometry3d> piece_ends_;
};

}  // namespace softarm
