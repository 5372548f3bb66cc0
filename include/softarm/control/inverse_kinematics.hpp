// The inverse kinematics (21): from a path of the tip to u'_ref and u''_ref.
#pragma once

#include <Eigen/Core>

#include "softarm/model/arm.hpp"

namespace softarm {

/// Gains of (21) as corrected: positions feed velocities through `lambda`, and so on.
struct InverseKinematicsGains {
  double lambda_1ps = 6.0;             ///< Lambda of q'_ref, 1/s
  double lambda_position_1ps2 = 36.0;  ///< Lambda_p of q''_ref, 1/s^2
  double lambda_velocity_1ps = 12.0;   ///< Lambda_d of q''_ref, 1/s
  /// J J' + damping^2 m^2/rad^2 is inverted in place of J J'; 0 is the plain pseudo-inverse.
  double damping_mprad = 0.0;
};

/// What the tip should do, in the world frame.
struct TipReference {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_mps2 = Eigen::Vector3d::Zero();
};

/// det(J J') / (tr(J J') / 3)^3: 1 for an isotropic J, 0 where the tip cannot move in some
/// direction.
double manipulability_ratio(const Eigen::Ref<const Eigen::Matrix3Xd>& jacobian) noexcept;

/// J^+ = J' X with X (3 x 3) = f(J J'): 1 / sigma^2 in directions in which the tip moves well
/// (sigma, a singular value of J, at least `hard_mprad`), less in harder ones: f(x) = 1 / (x + h (1
/// - x / 4h)^2), 4 h = hard_mprad^2. So |J^+ v| <= 1.3 / hard_mprad |v| wherever the arm is, J^+ is
/// continuous with its first derivative in J, and exact, J J^+ = I, where no direction is hard.
/// Closed form, no iteration. With n = 1 it is the least-squares solution in the plane of motion.
Eigen::Matrix3d damped_inverse(const Eigen::Ref<const Eigen::Matrix3Xd>& jacobian,
                               double hard_mprad) noexcept;

/// Below this ratio (damping included) J J' counts as singular.
inline constexpr double kMinManipulabilityRatio = 1e-12;

/// q'_ref  = J^+ (p_d' + Lambda (p_d - p)),
/// q''_ref = J^+ (p_d'' + Lambda_d (p_d' - J q') + Lambda_p (p_d - p) - J' q') (21) with J^+ = J'
/// (J J' + damping^2 I)^-1. The result is in the coordinates of `jacobian` (u or polar).
/// @param jacobian, jacobian_rate 3 x 2n at the state (best the reference state); @param velocity
/// 2n, q';
/// @param tip_position_m the measured tip p (the model's own leaves the model error in place).
/// @return false (zeros in the outputs) where J J' + damping^2 I is singular
/// (`kMinManipulabilityRatio`).
bool inverse_kinematics(const InverseKinematicsGains& gains,
                        const Eigen::Ref<const Eigen::Matrix3Xd>& jacobian,
                        const Eigen::Ref<const Eigen::Matrix3Xd>& jacobian_rate,
                        ConstVectorRef velocity, const Eigen::Vector3d& tip_position_m,
                        const TipReference& reference, VectorRef velocity_reference,
                        VectorRef acceleration_reference) noexcept;

}  // namespace softarm
