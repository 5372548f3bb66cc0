// Splits the residual of a fit by its repetition over the cycles of the input.
#pragma once

#include <string>

#include "softarm/commissioning/identification/motion_record.hpp"
#include "softarm/commissioning/identification/refinement.hpp"

namespace softarm {

/// RMS of a component, in rad, averaged over time; the squares of the three parts add up to that of
/// the residual, except for half a cycle at the ends.
struct ResidualParts {
  double period_s = 0.0;   ///< of the input; 0: it does not repeat, all is in `other_rad`
  double drift_rad = 0.0;  ///< of the mean over a cycle: offset, warming, material creep
  double cycle_rad = 0.0;  ///< repeated in every cycle: hysteresis, nonlinear characteristics
  double other_rad = 0.0;  ///< differences between cycles, noise
};

/// The period of the input in s: the first high peak of its autocorrelation; 0 if there is none
/// within a third of the record.
double input_period_s(const InputTrack& input, double from_s, double to_s);

/// The parts of the residual of `fit`, a fit to `record`, over the frames compared.
ResidualParts residual_parts(const MotionRecord& record, const Refinement& fit);

/// The parts as a sentence for a person.
std::string residual_parts_text(const ResidualParts& parts);

}  // namespace softarm
