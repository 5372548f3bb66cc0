// The mechanics of a simulated arm: an equation of motion in its own coordinates, and what can be
// seen of it from outside.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "softarm/model/arm.hpp"
#include "softarm/model/coordinates.hpp"
#include "softarm/simulation/actuator_input.hpp"
#include "softarm/simulation/external_loads.hpp"
#include "softarm/simulation/second_order_system.hpp"

namespace softarm {

/// How the arm lies, for logs and drawings.
struct PlantShape {
  Eigen::VectorXd bend_rad;               ///< [x, y] of every part, as u of a segment
  std::vector<Eigen::Vector3d> points_m;  ///< of the arm's axis, base to tip, in the world
};

/// A second-order system driven by n actuated segments, B(x) x'' + h(t, x, x') = 0. Coordinates x
/// are the kind's own. A kind writes `size`, `residual`, `powers` (SecondOrderSystem) and the
/// first three functions below; the others follow from these by differences, exact enough and slow,
/// and a kind overrides them where it knows better.
///
/// `residual` takes the chambers' moments from `input_` and what else acts on the arm from
/// `external_loads_`, `PlantSettings::payload_kg` and the acceleration of the base. A kind that
/// cannot do one of these refuses such settings when it is made (std::invalid_argument): nothing is
/// ignored in silence.
class PlantSystem : public SecondOrderSystem {
 public:
  /// @param stretches whether the kind simulates an arm that is `extensible`.
  /// @throw std::invalid_argument for such an arm where it does not.
  /// @param bends_otherwise whether it simulates what `MaterialSettings` adds to K u; the same throw.
  explicit PlantSystem(const PlantSettings& settings, bool stretches = false,
                       bool bends_otherwise = false);

  /// Of gravity (zero at the world's origin) and bending.
  virtual double potential_energy_j(ConstVector x) = 0;
  /// The x that uniform moments bending every segment by u (2n, rad) would give. Linear in u: it
  /// spreads u' to x' as well.
  virtual void spread(ConstVector u, Vector x) const = 0;
  /// World poses of the n actuated segments' ends, with the base where it is without base motion.
  virtual void segment_ends(ConstVector x, std::span<Eigen::Isometry3d> ends) const = 0;

  /// B from residuals, which are linear in x''.
  bool acceleration(double t_s, ConstVector x, ConstVector v, Vector a) override;
  void linearize(double t_s, ConstVector x, ConstVector v, ConstVector a, Matrix by_a, Matrix by_v,
                 Matrix by_x) override;
  virtual double kinetic_energy_j(ConstVector x, ConstVector v);
  /// u and u' (2n) of the PCC arm whose segments' ends are turned as this arm's are.
  virtual void curvature(ConstVector x, ConstVector v, Vector u, Vector rate) const;
  /// Of every segment (n, m) by how much it is longer than at rest, linear in x: rates alike. Empty
  /// where the arm does not stretch. By default the sum of every third coordinate of its parts.
  virtual SegmentScalars elongation_m(ConstVector x) const;
  /// Of the PCC arm of these u.
  virtual PlantShape shape(ConstVector x) const;

  /// Whether it has states that `remember` moves on: relaxation, slow beside a motion.
  virtual bool remembers() const { return false; }
  /// Time has passed and led to x.
  virtual void remember(double /*passed_s*/, ConstVector /*x*/) {}

  /// From t_s on the actuators make the generalized force (`ActuatorInput`) target + (present - target) exp(-(t - t_s) / lag_s); lag 0: target.
  void drive(double t_s, ConstVector present_nm, ConstVector target_nm, double lag_s) {
    input_.drive(t_s, present_nm, target_nm, lag_s);
  }
  ActuatorInput& input() { return input_; }
  ExternalLoads& external_loads() { return external_loads_; }
  const ExternalLoads& external_loads() const { return external_loads_; }

 protected:
  /// The shape of constant-curvature arcs, u of each, or (u, e) where they stretch.
  static PlantShape arcs(const ArmParameters& arm, ConstVector u);

  ActuatorInput input_;
  ExternalLoads external_loads_;
  ArmParameters segments_arm_;  ///< base and actuated segments as configured
};

/// u and u' of a PCC segment turned by `rotation` (of its end, in the frame of its start) that
/// turns at `velocity_radps` (in the frame of its start). Twist, which a PCC segment has not, is
/// left out. `chord` (start to end, in the frame of its start) decides between theta and 2 pi -
/// theta: valid on [0, 2 pi). The orientation part of the estimator's formula (docs: estimation).
void fit_segment(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& chord,
                 const Eigen::Vector3d& velocity_radps, Eigen::Vector2d& u, Eigen::Vector2d& rate);

}  // namespace softarm
