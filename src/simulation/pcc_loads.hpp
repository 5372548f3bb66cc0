// What hangs on, and pulls at, the segments' ends of a piecewise constant curvature arm.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "softarm/model/arm.hpp"
#include "softarm/simulation/external_loads.hpp"
#include "softarm/simulation/second_order_system.hpp"

namespace softarm {

/// Point masses and external loads through the Jacobians J of the ends they act on: J' f + J_omega'
/// m, and m J' (J u'' + J' u' - g) for a mass m, exactly. O(n) an end; nothing where there is none.
class PccLoads {
 public:
  using ConstVector = SecondOrderSystem::ConstVector;
  using Vector = SecondOrderSystem::Vector;
  using Matrix = SecondOrderSystem::Matrix;

  /// @param arm of pieces, `pieces` a segment. @param payload_kg of every segment's end, or empty.
  PccLoads(const ArmParameters& arm, int pieces, const std::vector<double>& payload_kg);

  bool has_payload() const { return has_payload_; }

  /// out += what the loads that are on do.
  void add_external(const ExternalLoads& loads, double t_s, ConstVector u, Vector out);

  /// out += m J' (J a + J' v - g).
  void add_payload(ConstVector u, ConstVector v, ConstVector a, const Eigen::Vector3d& gravity_mps2,
                   Vector out);
  /// B += m J' J and C += m J' J'.
  void add_payload(ConstVector u, ConstVector v, Matrix B, Matrix C);

  double kinetic_energy_j(ConstVector u, ConstVector v);
  double potential_energy_j(ConstVector u);

 private:
  /// The arm up to the end of a segment, and its Jacobians.
  struct End {
    ArmParameters arm;
    double payload_kg = 0.0;
    Eigen::Matrix3Xd jacobian, jacobian_rate;
  };

  std::vector<End> ends_;
  bool has_payload_ = false;
};

}  // namespace softarm
