// The arm of the paper's section VI as a second-order system: rigid links joined by two crossed
// revolute joints, and telescopes where segments stretch, behind valves.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "softarm/simulation/plant_system.hpp"
#include "softarm/simulation/settings.hpp"

namespace softarm {

/// Coordinates x are two angles a link, [a_1, b_1, a_2, b_2, ...]: link j is turned against the
/// link before by R_x(a_j) R_y(b_j) about its own start. Links are as long, and as heavy, as the
/// segment divided by their number: slender rods for distributed mass, points at their centres for
/// point masses. r = B x'' + h(x, x') in O(n) by Newton and Euler's recursion in the links' own
/// frames.
///
/// A chamber's moment follows the body: tau_x and tau_y act on the two axes of every joint of the
/// segment (the uniform internal moment). The paper's couple has fixed axes, x and y of the
/// segment's start, and acts on the segment's last link and, reversed, on the one before its first.
///
/// Of an arm that is extensible (`kStretches`) a link has a third coordinate, s_j, m: a prismatic
/// joint along its axis, by which it is longer than at rest; its mass stays spread evenly over its
/// length (a point: in its middle). An axial force acts on every s of the segment. r is NaN where a
/// link would have no length left.
template <bool kStretches>
class LinkSystem final : public PlantSystem {
 public:
  /// @throw std::invalid_argument for a number of links, a stiffness or a damping that cannot be.
  LinkSystem(const PlantSettings& settings, const LinkSettings& links);

  int size() const override { return kWidth * static_cast<int>(links_.size()); }
  double unit(Eigen::Index i) const override;  ///< of s: the link's length at rest
  void residual(double t_s, ConstVector x, ConstVector v, ConstVector a, Vector out) override;
  bool acceleration(double t_s, ConstVector x, ConstVector v, Vector a) override;
  /// B is exact. Left out of the other two are velocity products and what turns with the inertia
  /// forces: joint damping and stiffness outweigh them.
  void linearize(double t_s, ConstVector x, ConstVector v, ConstVector a, Matrix by_a, Matrix by_v,
                 Matrix by_x) override;
  Powers powers(double t_s, ConstVector x, ConstVector v) override;

  double kinetic_energy_j(ConstVector x, ConstVector v) override;
  double potential_energy_j(ConstVector x) override;
  void spread(ConstVector u, Vector x) const override;
  void segment_ends(ConstVector x, std::span<Eigen::Isometry3d> ends) const override;
  void curvature(ConstVector x, ConstVector v, Vector u, Vector rate) const override;
  PlantShape shape(ConstVector x) const override;

 private:
  static constexpr Eigen::Index kWidth = kStretches ? 3 : 2;

  struct Link {
    double length_m;  // at rest
    double mass_kg;
    double inertia_kgm2;  // about either axis across the link, through its centre, at that length
    double payload_kg;    // at its end
    double stiffness_nm_per_rad, damping_nms_per_rad;
  };
  /// Sine and cosine of a joint's angles.
  struct Turn {
    double sa, ca, sb, cb;
  };
  using Vec3 = Eigen::Vector3d;

  static Turn turn(double a, double b);
  static Vec3 into(const Turn& turn, const Vec3& v);    // from the link before into the link
  static Vec3 out_of(const Turn& turn, const Vec3& v);  // and back

  double length_m(std::size_t link, ConstVector x) const {
    if constexpr (kStretches) return links_[link].length_m + x[3 * Eigen::Index(link) + 2];
    return links_[link].length_m;
  }
  double inertia_kgm2(std::size_t link, double length_m) const {
    if constexpr (kStretches) return spread_kg(link) * length_m * length_m;
    return links_[link].inertia_kgm2;
  }
  /// The inertia along a link that stretches beside that of its centre, on the rate of its length.
  double spread_kg(std::size_t link) const {
    return links_[link].inertia_kgm2 / (links_[link].length_m * links_[link].length_m);
  }
  void place(ConstVector x);
  /// Acceleration of the base in its own axes.
  Vec3 base_acceleration(double t_s) const;
  /// Takes the loads that are on from what moves the links, whose turns are known.
  void subtract_loads(double t_s, ConstVector x);
  std::size_t last_link(int segment) const {
    return static_cast<std::size_t>((segment + 1) * per_segment_ - 1);
  }
  /// out += actuation and external forces, all generalized.
  void add_input(double t_s, ConstVector x, Vector out);
  void inertia(ConstVector x, Matrix B);

  int per_segment_;
  ArmParameters arm_;
  std::vector<Link> links_;
  std::vector<Eigen::Index> held_;       // s of segments of constant length in an extensible arm
  Eigen::VectorXd stiffness_, damping_;  // diagonals of K and D
  Vec3 gravity_;                         // in the base frame, without the base's acceleration

  // Of one evaluation, from base to tip and back.
  std::vector<Turn> turns_;
  std::vector<Vec3> force_, moment_;  // that move the link, about its start, in its frame
  std::vector<double> axial_n_;       // that lengthens it; empty where it has one length
  // Of one linearization, in the base frame.
  std::vector<Eigen::Matrix3d> rotation_;
  std::vector<Vec3> origin_;
  Eigen::Matrix<double, 6, Eigen::Dynamic> motion_;    // axis e, o x e of an angle; 0, e of s
  Eigen::Matrix<double, 6, Eigen::Dynamic> momentum_;  // L and p of what it carries, about the base
  Eigen::Matrix<double, 3, Eigen::Dynamic> swing_, lever_;  // e x g; e x (first moment carried)
  Eigen::MatrixXd inertia_;
  Eigen::VectorXd scratch_;
};

}  // namespace softarm
