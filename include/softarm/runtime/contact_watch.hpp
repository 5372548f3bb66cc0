// Does something push the arm? From the disturbance that the model-based observer finds.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "softarm/base/time.hpp"
#include "softarm/estimation/model_observer.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {

/// The force on the end of one segment that explains the sudden part of the disturbance: the least
/// squares of d - d_slow - J^T F, weighted by the inverse covariance of d, with F of the order of
/// kExpected_n where the arm's pose shows nothing of it (along a straight arm). d_slow follows d in
/// kMemory_s and stands still in contact: what lasts longer is a property of the arm, not a push.
///
/// A contact is a force above the threshold, either while the observer is surprised or above five
/// standard deviations; it ends when neither that nor more than half the threshold and two standard
/// deviations was there for kEnd_s. In its first tenth of a second the force is overestimated, up to
/// threefold. A pressure that is not there (a leak) moves the arm too: where measured pressures
/// lack more than half the threshold, there is no contact.
///
/// No allocation, no clock.
class ContactWatch {
 public:
  static constexpr double kExpected_n = 1.0, kMemory_s = 5.0, kEnd_s = 0.1;

  /// @throws std::invalid_argument where the segment is not one of the arm's
  ContactWatch(const ArmParameters& arm, const SafetySettings& settings);

  /// After each frame that the observer took while the arm is under control.
  /// @param missing_nm generalized force (2n) that the pressures lack, by their measurement; empty
  /// where they are not measured
  void judge(std::int64_t capture_ns, const ModelObserver& observer,
             ConstVectorRef missing_nm) noexcept;
  /// Forgets everything: the arm is not under control.
  void reset() noexcept;

  bool contact() const noexcept { return contact_; }
  /// What looked like a force is explained by the measured pressures.
  bool pressure_loss() const noexcept { return pressure_loss_; }
  const Eigen::Vector3d& force_n() const noexcept { return force_n_; }
  const Eigen::Matrix3d& covariance_n2() const noexcept { return covariance_n2_; }
  /// d_slow (2n, N m): the disturbance without the contact.
  const SegmentVector& slow_disturbance_nm() const noexcept { return slow_nm_; }

 private:
  double fit(const ModelObserver& observer, ConstVectorRef disturbance_nm,
             Eigen::Vector3d& force_n) noexcept;

  ArmParameters part_;  ///< up to the segment
  double threshold_n_;
  Eigen::Matrix3Xd jacobian_;
  SegmentVector slow_nm_, sudden_nm_;
  Eigen::Vector3d force_n_ = Eigen::Vector3d::Zero(), missing_n_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_n2_ = Eigen::Matrix3d::Zero();
  std::int64_t last_ns_ = kNever, above_ns_ = kNever;
  bool contact_ = false, pressure_loss_ = false;
};

}  // namespace softarm
