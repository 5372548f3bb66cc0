// Do the intervals keep what they promise? The same experiment on many simulated arms.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "softarm/commissioning/identification/parameter_set.hpp"
#include "softarm/commissioning/identification/step_response.hpp"

namespace softarm {

/// How often the intervals of an identification hold the truth, for arms drawn at random about the
/// configured one.
struct CoverageStudy {
  int seeds = 100;
  double spread =
      0.1;  ///< every true k, beta, gain and lag is that part off the configured at most
  int threads = 1;
  double window_s = 0.2;
};

/// One parameter over all seeds; relative to the truth where that is not zero.
struct CoverageRow {
  std::string name, unit;
  bool relative = true;
  int covered = 0;          ///< seeds whose 95 % interval holds the truth
  double bias = 0.0;        ///< mean error
  double scatter = 0.0;     ///< its standard deviation
  double half_width = 0.0;  ///< of the intervals, mean
  double worst = 0.0;       ///< largest |error|
};

/// The outcome of a CoverageStudy, one entry a parameter.
struct CoverageTable {
  std::vector<CoverageRow> rows;
  int seeds = 0;   ///< done
  int failed = 0;  ///< whose search did not converge; not in the rows
};

/// Draws the plant's true parameters anew for every seed, k and beta shared by the segments, plays
/// the steps on it, and fits from what the configuration believes.
/// @param progress is told how many seeds are done; may be empty
/// @param stop ends the study early, with the seeds done; may be empty
CoverageTable study_coverage(const Experiment& experiment, const StepPlan& plan,
                             const FitChoice& choice, const CoverageStudy& study,
                             const std::function<void(int done)>& progress,
                             const std::function<bool()>& stop);

}  // namespace softarm
