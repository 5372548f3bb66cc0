// Exact derivatives of the dynamics (16) and of statics: what optimal control, estimation and
// identification linearise with.
//
// What a segment does within its own frame is differentiated in dual numbers along its two or three
// coordinates. To everything else a change of them is a motion of one rigid body, whose effect on
// every other segment is linear in the moments and momenta that B and C are made of: O(n^2), with no
// step to choose, good to round-off of the terms themselves.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "softarm/model/arm.hpp"

namespace softarm {

using MatrixRef = Eigen::Ref<Eigen::MatrixXd>;

/// Derivatives of one arm's model, with the storage they need. Sizes are 2n (3n where segments
/// stretch) and square matrices of that size; column j is the derivative along coordinate j. No
/// function but the constructor allocates. Not for use by two threads at a time. NaN in gives NaN
/// out.
class ModelDerivatives {
 public:
  /// @throws std::invalid_argument if the arm has no segments.
  explicit ModelDerivatives(const ArmParameters& arm);
  ~ModelDerivatives();
  ModelDerivatives(ModelDerivatives&&) noexcept;
  ModelDerivatives& operator=(ModelDerivatives&&) noexcept;

  /// d (B u'' + C u' + D u' + G + K u) / d u with u' and u'' held, in N m/rad.
  void inverse_dynamics_by_u(ConstVectorRef u, ConstVectorRef velocity, ConstVectorRef acceleration,
                             MatrixRef by_u) noexcept;

  /// K + dG/du, in N m/rad: the slope of `static_moments`, symmetric but for rounding. The shape at
  /// rest moves by (K + dG/du - d(A tau_A)/du)^-1 A for unit tau_A.
  void static_stiffness(ConstVectorRef u, MatrixRef by_u) noexcept;

  /// u'' of `forward_dynamics` and its derivatives: -B^-1 d(inverse dynamics)/du, -B^-1 (2 C + D)
  /// and B^-1, in 1/s^2, 1/s and 1/(kg m^2). The force is held; one that depends on u adds
  /// by_force times its slope (`actuation_slope`).
  /// @return false (and NaN everywhere) where B is not positive definite in double precision.
  bool forward_dynamics(ConstVectorRef u, ConstVectorRef velocity, ConstVectorRef generalized_force,
                        VectorRef acceleration, MatrixRef by_u, MatrixRef by_velocity,
                        MatrixRef by_force) noexcept;

 private:
  struct Storage;
  std::unique_ptr<Storage> storage_;
};

/// d (A(u) tau_A) / du with tau_A held, in N m/rad: zero for `chamber`, blocks of 2 x 2 for
/// `couple`.
void actuation_slope(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef tau_actuation_nm,
                     MatrixRef by_u) noexcept;

}  // namespace softarm
