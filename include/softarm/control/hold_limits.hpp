// What chambers can hold, for who plans motions and knows nothing of chambers.
#pragma once

#include <optional>

#include "softarm/model/arm.hpp"

namespace softarm {

/// Asked in the tick: no allocation, no exception, bounded work.
class HoldLimits {
 public:
  virtual ~HoldLimits() = default;

  /// theta_rad: n. The largest theta of every segment, in the direction in which it bends at u (2n,
  /// rad), that its chambers can hold at rest against stiffness and gravity, to first order from u:
  /// exact in that it is at least theta where u can be held, and less where not.
  virtual void largest_bend(ConstVectorRef u_rad, VectorRef theta_rad) noexcept = 0;

  /// phi of the plane of a planar arm.
  virtual std::optional<double> plane_rad() const noexcept { return {}; }
};

}  // namespace softarm
