// The curves that are known beforehand: set point, (24), way points. Times count from the beginning
// of the phase.
#pragma once

#include "softarm/control/reference.hpp"

namespace softarm {

/// Of a minimum-jerk (quintic) motion over its mean speed.
inline constexpr double kQuinticPeakSpeed = 1.875;

/// All three vectors of `out` must have their size; has_polar is set for (24).
void evaluate(const SetPointReference& curve, double time_s, ReferenceSample& out) noexcept;
void evaluate(const PaperReference& curve, double time_s, ReferenceSample& out) noexcept;
void evaluate(const WayPointReference& curve, double time_s, ReferenceSample& out) noexcept;

/// Largest theta (rad) and a bound on the largest |u'| of a segment (rad/s).
double largest_theta_rad(const ReferenceKind& kind) noexcept;
double largest_speed_radps(const ReferenceKind& kind) noexcept;

/// @throws ReferenceError if the phase does not fit the arm or the limits
void check_phase(int phase, const ReferenceKind& kind, const ControllerSettings& control,
                 int segments);

}  // namespace softarm
