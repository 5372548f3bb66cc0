// The arm at rest: the moments that hold a shape, and the shape that given moments hold.
// K u + G(u) = A(u) tau_A, which is (16) without motion.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "softarm/model/arm.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {

/// out = G(u) of (16), 2n, N m. O(n), allocates nothing. `out` may not alias u.
void gravity_moments(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                     VectorRef out) noexcept;

/// out = K u + G(u), 2n, N m: the generalized force that holds the arm at rest in u. O(n),
/// allocates nothing. `out` may not alias u.
void static_moments(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                    VectorRef out) noexcept;

/// Slope of G at u (2n x 2n, N m/rad, symmetric but for rounding), exact: `static_stiffness` of
/// derivatives.hpp without springs. Not for the loop: allocates.
Eigen::MatrixXd gravity_slope(const ArmParameters& arm, const Eigen::VectorXd& u);

/// What is left of a static balance at u, 2n, N m.
using Imbalance = std::function<void(const Eigen::VectorXd& u, Eigen::VectorXd& out)>;

/// The u (2n, rad) at which nothing is left of a balance, found from `start` by Newton's method
/// with steps of at most 0.5 rad; nothing where it does not converge. Of several shapes that
/// balance, the one found need not be stable. Not for the loop: allocates.
std::optional<Eigen::VectorXd> solve_balance(const Imbalance& imbalance, Eigen::VectorXd start);

/// The shape at rest near straight under the moments tau_A (2n, N m; zero: what gravity and the
/// springs make of the arm). As `solve_balance`.
std::optional<Eigen::VectorXd> rest_shape(const ArmParameters& arm,
                                          const Eigen::VectorXd& tau_actuation_nm);

}  // namespace softarm
