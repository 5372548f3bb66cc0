// The dynamics B(u) u'' + C(u, u') u' + D u' + G(u) + K u = A tau_A + J' f of (16), direct route,
// in u.
//
// Two ways in: `inverse_dynamics` evaluates B x + C(u, y) z + G in O(n) without forming a matrix
// (what the controller (17) and implicit integrators need); `dynamics_matrices` forms B, C and G.
// Both know both mass models of `ArmParameters`. Nothing here allocates: all storage is in the
// caller's workspace. NaN in gives NaN out.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "softarm/model/arm.hpp"

namespace softarm {

/// Storage for every function below, made once for an arm of n segments. Not for use by two threads
/// at a time.
class DynamicsWorkspace {
 public:
  /// @throws std::invalid_argument if the arm has no segments.
  explicit DynamicsWorkspace(const ArmParameters& arm);
  ~DynamicsWorkspace();
  DynamicsWorkspace(DynamicsWorkspace&&) noexcept;
  DynamicsWorkspace& operator=(DynamicsWorkspace&&) noexcept;

  struct Storage;
  Storage& storage() noexcept { return *storage_; }

 private:
  std::unique_ptr<Storage> storage_;
};

/// Which terms `inverse_dynamics` evaluates; one that is left out costs nothing.
struct DynamicsTerms {
  bool inertia = true;
  bool coriolis = true;
  bool gravity = true;
};

/// out = B(u) acceleration + C(u, velocity_a) velocity_b + G(u), in N m (generalized moments in u),
/// each 2n. C is the Christoffel matrix, so the product is symmetric in velocity_a and velocity_b.
/// One O(n) recursion of Newton-Euler type. `out` may not alias an input. Arguments of terms left
/// out are not read.
void inverse_dynamics(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                      ConstVectorRef velocity_a, ConstVectorRef velocity_b,
                      ConstVectorRef acceleration, DynamicsTerms terms, VectorRef out) noexcept;

/// B (2n x 2n, symmetric positive definite), C (2n x 2n, Christoffel: B' - 2C is skew) and G (2n)
/// in O(n^2).
void dynamics_matrices(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                       ConstVectorRef velocity, Eigen::Ref<Eigen::MatrixXd> B,
                       Eigen::Ref<Eigen::MatrixXd> C, VectorRef G) noexcept;

/// The same in polar coordinates q = [phi_1, theta_1, ...] (rad), from the columns along phi and
/// theta: B_q = P' B P, C_q = P' (B P_rate + C P), G_q = P' G with u' = P q'. The phi rows keep
/// their relative accuracy down to theta = 0, where they vanish.
void polar_dynamics_matrices(const ArmParameters& arm, DynamicsWorkspace& workspace,
                             ConstVectorRef q, ConstVectorRef velocity,
                             Eigen::Ref<Eigen::MatrixXd> B, Eigen::Ref<Eigen::MatrixXd> C,
                             VectorRef G) noexcept;

/// B alone, 2n x 2n, as `dynamics_matrices` gives it.
void inertia_matrix(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                    Eigen::Ref<Eigen::MatrixXd> B) noexcept;

/// u'' of (16): solves B u'' = input - C u' - D u' - G - K u.
/// @param generalized_force 2n, N m: A tau_A (see `apply_actuation`) plus J' f of any external
/// force.
/// @return false (and NaN in `acceleration`) where B is not positive definite in double precision.
bool forward_dynamics(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                      ConstVectorRef velocity, ConstVectorRef generalized_force,
                      VectorRef acceleration) noexcept;

/// Solves B x = rhs for symmetric positive definite B by L D L' and one step of refinement, with
/// the residual in extended precision.
/// @return false (and NaN in x) where B is not positive definite in double precision. `x` may alias
/// `rhs`.
bool solve_inertia(DynamicsWorkspace& workspace, const Eigen::Ref<const Eigen::MatrixXd>& B,
                   ConstVectorRef rhs, VectorRef x) noexcept;

/// Of an extensible arm whose B x = force is to be solved: takes the e of segments of
/// `constant_length` out, so that their x is 0. O(n^2) for each of them.
void hold_constant_lengths(const ArmParameters& arm, Eigen::Ref<Eigen::MatrixXd> B,
                           VectorRef force) noexcept;

/// 1/2 u'^T B u', in J. O(n).
double kinetic_energy(const ArmParameters& arm, DynamicsWorkspace& workspace, ConstVectorRef u,
                      ConstVectorRef velocity) noexcept;

/// U = -sum mu_i g . c_i, in J, so that G = dU/du. Zero height is the world's origin.
double gravity_potential(const ArmParameters& arm, ConstVectorRef u) noexcept;

/// force += J' f: adds what a force on the tip (N, world frame) does, 2n, in O(n).
void add_tip_force(const ArmParameters& arm, ConstVectorRef u, const Eigen::Vector3d& force_n,
                   VectorRef generalized_force) noexcept;

/// force += K u + D u' of (14): k I and beta I a segment in u, k_a and beta_a in e.
void add_impedance(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef velocity,
                   VectorRef generalized_force) noexcept;

}  // namespace softarm
