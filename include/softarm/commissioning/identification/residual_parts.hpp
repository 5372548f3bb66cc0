// What a fit leaves over, by how it returns.
#pragma once

#include <string>

#include "softarm/commissioning/identification/motion_record.hpp"
#include "softarm/commissioning/identification/refinement.hpp"

namespace softarm {

/// RMS of a component, in rad, averaged over time; the squares of the three add up to that of the
/// residual, but for half a cycle at the ends.
struct ResidualParts {
  double period_s = 0.0;   ///< of the input; 0: it does not repeat, and all is in `other_rad`
  double drift_rad = 0.0;  ///< of the mean over a cycle: offset, warming up, creep
  double cycle_rad = 0.0;  ///< the same in every cycle: hysteresis, curved characteristics
  double other_rad = 0.0;  ///< cycles that differ, noise
};

/// The time after which the input repeats, s: the first high peak of its autocorrelation; 0 where
/// there is none within a third of the record.
double input_period_s(const InputTrack& input, double from_s, double to_s);

/// Of the frames compared, of a fit to `record`.
ResidualParts residual_parts(const MotionRecord& record, const Refinement& fit);

std::string residual_parts_text(const ResidualParts& parts);

}  // namespace softarm
