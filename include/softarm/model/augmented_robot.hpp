// The paper's own route: the rigid robot of Table I, ten joints and one point mass a segment, tied
// to the arm by xi = m(q).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>

#include "softarm/model/arm.hpp"
#include "softarm/model/kinematics.hpp"

namespace softarm {

class SerialRobot;

/// (5) to (13) in the paper's coordinates q = [phi_1, theta_1, ...], for theta of either sign: the
/// reference for the direct route of dynamics.hpp and kinematics.hpp. Point masses only.
///
/// Accuracy, with eps the unit round-off and l the arm's length:
/// - for any theta down to 0 every term is that of the direct route to 1e-12 of its largest entry.
///   C and G may vanish as a whole by symmetry (C of one segment, G of a hanging arm, as all theta
///   go to 0), and are then good to 16 eps of the size they have in general, |B| |q'| and mu |g| l:
///   C of one segment at theta = 1e-4 to 4e-12 of its largest entry, as in the direct route;
/// - row phi_i by itself loses eps / theta_i: what joints 1 and 10 of segment i do to the masses
///   behind it cancels up to theta_i, and leaves an error of about 2 eps l in a column of J. At
///   theta_i = 1e-8 half of the row's digits are left, at 1e-16 none. The direct route in u has no
///   such loss, nor has this one where i is the last segment.
/// B itself is singular where a theta_i is 0, as in the paper.
///
/// No function but the constructor allocates. Not for use by two threads at a time. NaN in gives
/// NaN out.
class AugmentedRobot {
 public:
  /// @throws std::invalid_argument without segments, with distributed mass, or if the arm stretches.
  explicit AugmentedRobot(const ArmParameters& arm);
  ~AugmentedRobot();
  AugmentedRobot(AugmentedRobot&&) noexcept;
  AugmentedRobot& operator=(AugmentedRobot&&) noexcept;

  /// Evaluates everything below for q and q', 2n each, in rad and rad/s.
  void update(ConstVectorRef q, ConstVectorRef velocity) noexcept;

  /// xi = m(q), 10n: [rad, rad, m, rad, rad, rad, rad, m, rad, rad] a segment. (6), (10)
  const Eigen::VectorXd& xi() const noexcept { return xi_; }
  /// xi' = J_m q'. (11)
  const Eigen::VectorXd& xi_velocity() const noexcept { return xi_velocity_; }
  /// J_m = dm/dq, 10n x 2n.
  const Eigen::MatrixXd& map_jacobian() const noexcept { return map_jacobian_; }
  /// d J_m / dt along q'.
  const Eigen::MatrixXd& map_jacobian_rate() const noexcept { return map_jacobian_rate_; }

  /// B = J_m' B_xi J_m, 2n x 2n. Here and in C and G, B_xi = sum mu J_xi' J_xi is kept in factors:
  /// formed first it would cost phi rows the square of what they lose. (13)
  const Eigen::MatrixXd& B() const noexcept { return B_; }
  /// C = J_m' B_xi J_m-dot + J_m' C_xi J_m, 2n x 2n, Christoffel: B' - 2C is skew. (13)
  const Eigen::MatrixXd& C() const noexcept { return C_; }
  /// G = J_m' G_xi, 2n. (13)
  const Eigen::VectorXd& G() const noexcept { return G_; }

  /// J = J_xi J_m of the tip in the world, 3 x 2n, in m/rad, and dJ/dt along q'. (13)
  void tip_jacobians(JacobianRef J, JacobianRef J_rate) noexcept;
  /// Angular velocity of S_n in the world for unit q', 3 x 2n.
  void tip_angular_jacobian(JacobianRef J) noexcept;

  /// World pose of S_i, i = 0 ... n: the frame after joint 10 of segment i.
  Eigen::Isometry3d segment_end(int i) const noexcept;
  /// World position of segment i's mass, i = 1 ... n: the frame after its joint 5.
  Eigen::Vector3d mass_centre(int i) const noexcept;

  /// B_xi and C_xi (Christoffel), 10n x 10n, and G_xi, 10n, of the rigid robot as it stands since
  /// `update`: what (13) projects.
  void rigid_dynamics(Eigen::Ref<Eigen::MatrixXd> B_xi, Eigen::Ref<Eigen::MatrixXd> C_xi,
                      VectorRef G_xi) noexcept;
  /// J_xi of the tip in the world, 3 x 10n.
  void rigid_tip_jacobian(JacobianRef J_xi) noexcept;

 private:
  void map(ConstVectorRef q, ConstVectorRef velocity) noexcept;
  void project(int segments) noexcept;

  ArmParameters arm_;
  std::unique_ptr<SerialRobot> robot_;
  Eigen::Vector3d gravity_;  ///< in S_0
  Eigen::VectorXd xi_, xi_velocity_, G_;
  Eigen::MatrixXd map_jacobian_, map_jacobian_rate_, B_, C_;
  Eigen::Matrix3Xd J_xi_, J_xi_rate_, J_, J_rate_;  ///< of one point in S_0
};

}  // namespace softarm
