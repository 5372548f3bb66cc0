// The input matrix A of (15) in u: generalized force = A tau_A, tau_A moments about the local x and
// y axes of S_{i-1}.
#pragma once

#include <Eigen/Core>

#include "softarm/model/arm.hpp"

namespace softarm {

/// A of one segment, 2 x 2. `couple`: (15), transpose corrected, det = c1 = sin theta / theta,
/// singular at theta = pi. `chamber`: [[0, 1], [-1, 0]] everywhere.
Eigen::Matrix2d actuation_matrix(ActuationModel model, const Eigen::Vector2d& u_rad) noexcept;

/// What `solve_actuation` may do where A of `couple` is nearly singular: |det A| is bounded below
/// by this.
inline constexpr double kMinActuationDeterminant = 0.05;

/// tau_A = A^-1 force of one segment, in N m. The determinant is kept at or above `min_determinant`
/// in magnitude, so the answer is bounded (and no longer exact) near theta = pi; 0 switches the
/// bound off.
Eigen::Vector2d solve_actuation(ActuationModel model, const Eigen::Vector2d& u_rad,
                                const Eigen::Vector2d& force_nm,
                                double min_determinant = kMinActuationDeterminant) noexcept;

/// out = A tau_A for the whole arm, 2n each, in N m; with [tau_x, tau_y, N] a segment, 3n, where
/// segments stretch: A is then [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], and `couple` gives NaN.
void apply_actuation(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef tau_actuation_nm,
                     VectorRef out) noexcept;

/// tau_A = A^-1 force for the whole arm, bounded as `solve_actuation` is.
void solve_actuation(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef force_nm,
                     VectorRef tau_actuation_nm,
                     double min_determinant = kMinActuationDeterminant) noexcept;

}  // namespace softarm
