// The constant description of a soft arm and the vector types that every module shares.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

namespace softarm {

/// Capacity of the fixed-size types used inside the control loop; the number of segments itself is
/// chosen at run time.
inline constexpr int kMaxSegments = 128;

/// Two numbers a segment, [u1_x, u1_y, u2_x, u2_y, ...]. Run-time size, storage in place: copying
/// it never allocates.
using SegmentVector =
    Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 2 * kMaxSegments, 1>;
using ConstVectorRef = const Eigen::Ref<const Eigen::VectorXd>&;
using VectorRef = Eigen::Ref<Eigen::VectorXd>;

/// One constant-curvature segment of the piecewise constant curvature (PCC) arm.
struct SegmentParameters {
  double length_m = 0.11;
  double mass_kg = 0.15;
  double stiffness_nm_per_rad = 0.626;  ///< k of (14)
  double damping_nms_per_rad = 0.029;   ///< beta of (14)
  /// Of the round cross-section, whose rotary inertia mu r^2/4 a unit of arc the paper leaves out;
  /// 0 leaves it out too and costs nothing. Distributed mass only: a point has no cross-section.
  double radius_m = 0.0;
  /// Along the axis, for arms that are `extensible` only. The defaults are those of a solid rod that
  /// bends as the values above: k_a / k = beta_a / beta = area / second moment of area.
  double axial_stiffness_n_per_m = 4000.0;  ///< k_a
  double axial_damping_ns_per_m = 185.0;    ///< beta_a
  /// A segment of an extensible arm that does not stretch: its e is 0 for good and its e'' is 0
  /// whatever acts on it; the e row of the inverse dynamics is the force that holds it.
  bool constant_length = false;
};

/// Where a segment's mass sits. `point` is the paper's (all of it at the centre of mass, no
/// rotational inertia); `distributed` spreads it homogeneously along the arc.
enum class MassModel { point, distributed };

/// Which input matrix A maps tau_A to generalized forces: `couple` is the paper's (15),
/// transpose corrected (singular at theta = pi); `chamber` the body-following moment of chambers
/// and tendons (never singular).
enum class ActuationModel { chamber, couple };

/// An arm of n segments hanging from, or standing on, a base frame S_0. The straight arm points
/// along +z of S_0.
struct ArmParameters {
  std::vector<SegmentParameters> segments;
  MassModel mass = MassModel::distributed;
  ActuationModel actuation = ActuationModel::chamber;
  /// p_world = base_rotation * p_0 + base_position_m; the default hangs from a ceiling.
  Eigen::Matrix3d base_rotation = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  Eigen::Vector3d base_position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d gravity_mps2 = Eigen::Vector3d(0.0, 0.0, -9.81);  ///< in the world frame
  /// Segments that stretch have three coordinates, [u_x, u_y, e] with e the elongation in m, and
  /// tau_A = [tau_x, tau_y, N] with N the axial force in N, positive where it lengthens; `length_m`
  /// is then the length at rest, and length_m + e > 0 the present one, uniform along the arc. Mass
  /// stretches with the segment, radius_m stays. All 2n below become 3n. Only `chamber` actuation.
  bool extensible = false;

  int size() const { return static_cast<int>(segments.size()); }
  int segment_dof() const { return extensible ? 3 : 2; }
  int dof() const { return segment_dof() * size(); }
  /// Of all segments, at rest.
  double length_m() const;
};

/// For what does not know segments that stretch. @throw std::invalid_argument for an arm that is
/// extensible. @param who begins the message.
void expect_constant_length(const ArmParameters& arm, const char* who);

}  // namespace softarm
