// The mechanics of a simulated arm: an equation of motion in coordinates of its own, and what can
// be seen of it from outside.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <span>

#include "simulation/actuator_input.hpp"
#include "simulation/external_loads.hpp"
#include "simulation/second_order_system.hpp"
#include "softarm/simulation/settings.hpp"

namespace softarm {

/// A second-order system driven by n actuated segments. Coordinates x are the kind's own.
class PlantSystem : public SecondOrderSystem {
 public:
  PlantSystem(int segments, const PlantSettings& settings)
      : input_(2 * segments), external_loads_(settings) {}

  /// From t_s on the actuators make the generalized force (A_chamber tau_A of every segment, 2n,
  /// N m) target + (present - target) exp(-(t - t_s) / lag_s); lag 0: target.
  void drive(double t_s, ConstVector present_nm, ConstVector target_nm, double lag_s) {
    input_.drive(t_s, present_nm, target_nm, lag_s);
  }
  ActuatorInput& input() { return input_; }
  ExternalLoads& external_loads() { return external_loads_; }
  const ExternalLoads& external_loads() const { return external_loads_; }

  virtual double kinetic_energy_j(ConstVector x, ConstVector v) = 0;
  /// Of gravity (zero at the world's origin) and bending.
  virtual double potential_energy_j(ConstVector x) = 0;

  /// The x that uniform moments bending every segment by u (2n, rad) would give. Linear in u: it
  /// spreads u' to x' as well.
  virtual void spread(ConstVector u, Vector x) const = 0;

  /// World poses of the n actuated segments' ends.
  virtual void segment_ends(ConstVector x, std::span<Eigen::Isometry3d> ends) const = 0;

  /// u and u' (2n) of the PCC arm whose segments' ends are turned as this arm's are.
  virtual void curvature(ConstVector x, ConstVector v, Vector u, Vector rate) const = 0;

 protected:
  ActuatorInput input_;
  ExternalLoads external_loads_;
};

/// @throw std::invalid_argument where `settings` ask for parts that cannot be.
std::unique_ptr<PlantSystem> make_plant_system(const PlantSettings& settings);

/// u and u' of a PCC segment turned by `rotation` (of its end, in the frame of its start) that
/// turns at `velocity_radps` (in the frame of its start). Twist, which a PCC segment has not, is
/// left out. `chord` (start to end, in the frame of its start) decides between theta and 2 pi -
/// theta: valid on [0, 2 pi). The orientation part of the estimator's formula (docs: estimation).
void fit_segment(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& chord,
                 const Eigen::Vector3d& velocity_radps, Eigen::Vector2d& u, Eigen::Vector2d& rate);

}  // namespace softarm
