// By how much an arm differs from its configured model: what the observer estimates and the
// controller uses.
#pragma once

#include <Eigen/Core>
#include <array>

#include "softarm/model/arm.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {

/// Corrections of one segment, all zero for the configured model.
struct SegmentCorrection {
  double stiffness = 0.0;  ///< relative: the arm's k is (1 + stiffness) times the configured one
  double damping = 0.0;    ///< relative, of beta
  double gain = 0.0;       ///< relative, of the moment that the chambers give
  /// Horizontal load on the segment's row of G: acceleration along two axes across gravity, as a
  /// fraction of |g|. A base tilted by 10 degrees is 0.17 on every segment.
  Eigen::Vector2d load = Eigen::Vector2d::Zero();
  /// Of segments that stretch, along e: relative, of k_a, beta_a and the chambers' areas, and an
  /// unknown axial force, N.
  double axial_stiffness = 0.0, axial_damping = 0.0, axial_gain = 0.0, axial_force_n = 0.0;
};

/// The corrected form of (16):
///   B u'' + C u' + (1 + damping) D u' + G + H(u, load) + (1 + stiffness) K u
///     = (1 + gain) A tau_A + disturbance,
/// and the same along e of segments that stretch, with axial_stiffness ... axial_force_n and no H.
struct ModelCorrection {
  std::array<SegmentCorrection, kMaxSegments> segment;
  SegmentVector disturbance_nm;  ///< 2n, generalized force in u, whether segments stretch or not
};

/// H(u, load): row i of G for horizontal gravity |g| (load_i,x e_x + load_i,y e_y), with e_x, e_y
/// orthonormal and across gravity; for a hanging arm in a world with z up they are the world's x
/// and y. Zero where there is no gravity.
class HorizontalLoad {
 public:
  explicit HorizontalLoad(const ArmParameters& arm);

  /// along_x, along_y: 2n, G(u) for gravity |g| e_x and |g| e_y. O(n), no allocation.
  void rows(ConstVectorRef u, DynamicsWorkspace& workspace, VectorRef along_x,
            VectorRef along_y) const noexcept;

  /// |g| e_x and |g| e_y, world frame.
  const Eigen::Vector3d& gravity_x_mps2() const noexcept { return arm_x_.gravity_mps2; }
  const Eigen::Vector3d& gravity_y_mps2() const noexcept { return arm_y_.gravity_mps2; }
  /// Of an arm whose segments stretch and are now so long, m; n numbers.
  void set_lengths(ConstVectorRef length_m) noexcept;

 private:
  ArmParameters arm_x_, arm_y_;
};

}  // namespace softarm
