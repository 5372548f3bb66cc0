// What the chambers can hold at rest.
#pragma once

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/control/hold_limits.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {

/// From statics, K u + G(u) = A(u) tau_A, and the torques that the chambers reach.
class StaticHold final : public HoldLimits {
 public:
  /// @throws std::invalid_argument as PressureAllocator and DynamicsWorkspace
  StaticHold(const ArmParameters& arm, const ActuationSettings& actuation);

  void largest_bend(ConstVectorRef u_rad, VectorRef theta_rad) noexcept override;
  std::optional<double> plane_rad() const noexcept override { return plane_rad_; }

 private:
  ArmParameters arm_;
  std::optional<double> plane_rad_;
  DynamicsWorkspace workspace_;
  PressureAllocator allocator_;
  double beyond_nm_;  ///< a torque that no segment's chambers reach
  SegmentVector force_nm_, torque_nm_;
  SegmentScalars scale_;
};

}  // namespace softarm
