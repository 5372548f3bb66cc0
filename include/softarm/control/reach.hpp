// Which points the tip can reach.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "softarm/model/arm.hpp"
#include "softarm/model/coordinates.hpp"

namespace softarm {

/// Damped least squares on the tip's Jacobian, with at most max_theta_rad a segment and, of a planar
/// arm, in its plane. No allocation after construction.
class TipSearch {
 public:
  /// @param most_elongation_m n, of segments that stretch: e is between 0 and that
  TipSearch(const ArmParameters& arm, double max_theta_rad, std::optional<double> plane_rad,
            const SegmentScalars& most_elongation_m = {});

  /// Takes the nearest pose so far as `u_rad` (2n; 3n where segments stretch) for a target (m, world).
  void begin(const Eigen::Vector3d& target_m, ConstVectorRef u_rad) noexcept;
  /// At most so many steps from the pose `start`; ends where it is near enough. O(n) a step.
  void search(ConstVectorRef start, int steps) noexcept;
  /// The same from an arc that bends every segment by `part` of max_theta_rad towards the target.
  void search_from_arc(double part, int steps) noexcept;

  /// Of the nearest pose that was found to the target.
  double distance_m() const noexcept { return nearest_m_; }
  const SegmentVector& u_rad() const noexcept { return best_; }
  /// Below 1e-4 of the arm's length: no search goes on.
  bool found() const noexcept;
  /// Steps of all searches since begin().
  int steps() const noexcept { return steps_; }

 private:
  void project(SegmentVector& u) const noexcept;

  ArmParameters arm_;
  double max_theta_rad_, length_m_;
  std::optional<double> plane_rad_;
  SegmentScalars most_elongation_m_;
  Eigen::Vector3d target_m_ = Eigen::Vector3d::Zero();
  double nearest_m_ = 0.0;
  int steps_ = 0;
  SegmentVector best_, u_, step_;
  Eigen::Matrix3Xd jacobian_;
};

/// Distance in m from `target_m` (world) to the nearest point that is found for the tip with at most
/// `max_theta_rad` a segment, in the plane of a planar arm, from several poses; so a little above
/// the true distance at worst. For load time.
/// @param u_rad 2n (3n where segments stretch); in: a pose to start from too, out: the pose that was
/// found @param most_elongation_m n, of segments that stretch: e is between 0 and that
double distance_out_of_reach_m(const ArmParameters& arm, double max_theta_rad,
                               std::optional<double> plane_rad, const Eigen::Vector3d& target_m,
                               Eigen::VectorXd& u_rad,
                               const SegmentScalars& most_elongation_m = {});

}  // namespace softarm
