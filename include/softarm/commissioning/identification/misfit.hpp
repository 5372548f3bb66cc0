// Whether what was identified explains what was recorded, and what else would.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "softarm/commissioning/identification/refinement.hpp"

namespace softarm {

/// A term that was left out, and what is left over with it.
struct MisfitCause {
  std::string name;
  double value = 0.0;  ///< of its first unknown, in `unit`
  std::string unit;
  double rms_rad = 0.0;
  double slow_ratio = 0.0;  ///< as `Misfit::slow_ratio`, with it
};

/// The residual beside the noise of the frames.
struct Misfit {
  double noise_rad = 0.0;  ///< RMS of a component, as configured; 0: not known, nothing is judged
  double ratio = 0.0;      ///< of the residual's RMS to it
  /// The same of means over half a second, in what means of white noise have: 1 without misfit. What
  /// is wrong with a model is slow beside the frames, so this shows far less of it.
  double slow_ratio = 0.0;
  bool significant = false;
  std::vector<MisfitCause> causes;  ///< those that explain some of it, the likeliest first
  /// How far what the causes give, with its interval, reaches from the unknowns, at most, in the scales
  /// of the set: noise does not make this error, so intervals that count it alone are too narrow.
  Eigen::VectorXd shift;
};

/// A residual, or its means over half a second, beyond 1.25 times what noise has is no noise (a thousand
/// frames scatter by 3 %). Then a load
/// at the tip, another length, other masses, hysteresis, a rest offset and a cubic stiffness are
/// freed in turn, as far as `choice` has them fixed; each takes as long as identifying.
/// @param seek_causes  false: none of that
Misfit judge_misfit(const ArmHypothesis& start, ActuationKind kind, const FitChoice& choice,
                    std::span<const MotionRecord> records, const Refinement& fit,
                    const RefinementOptions& options, bool seek_causes = true);

/// Widens the intervals of `fit` by the shift.
void widen(const Misfit& misfit, Refinement& fit);

/// For a person; empty where nothing is wrong or known.
std::string misfit_text(const Misfit& misfit);

}  // namespace softarm
