// Coverage of the confidence intervals: the same experiment on many simulated arms.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "softarm/commissioning/identification/parameter_set.hpp"
#include "softarm/commissioning/identification/step_response.hpp"

namespace softarm {

/// Settings of a coverage study.
struct CoverageStudy {
  int seeds = 100;
  double spread = 0.1;  ///< largest relative deviation of a true k, beta, gain or lag
  int threads = 1;
  double window_s = 0.2;  ///< as IdentifyOptions::window_s
};

/// One parameter over all seeds; errors are relative to the true value where that is not zero.
struct CoverageRow {
  std::string name, unit;
  bool relative = true;
  int covered = 0;          ///< seeds whose 95 % interval contains the true value
  double bias = 0.0;        ///< mean error
  double scatter = 0.0;     ///< standard deviation of the error
  double half_width = 0.0;  ///< mean half width of the intervals
  double worst = 0.0;       ///< largest |error|
};

/// The result of a coverage study.
struct CoverageTable {
  std::vector<CoverageRow> rows;
  int seeds = 0;   ///< done
  int failed = 0;  ///< seeds whose search did not converge; not in the rows
};

/// For every seed, draws new true parameters of the plant (k and beta shared by the segments),
/// plays the steps on it and fits, starting from the configured parameters.
/// @param progress  called with the number of seeds done; may be empty
/// @param stop  ends the study early, with the seeds done so far; may be empty
CoverageTable study_coverage(const Experiment& experiment, const StepPlan& plan,
                             const FitChoice& choice, const CoverageStudy& study,
                             const std::function<void(int done)>& progress,
                             const std::function<bool()>& stop);

}  // namespace softarm
