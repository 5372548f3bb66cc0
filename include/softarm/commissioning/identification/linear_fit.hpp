// What (16) says about its parameters by linear least squares: where the refinement starts, and all
// there is for arms whose response cannot be simulated quickly.
#pragma once

#include "softarm/commissioning/identification/parameter_set.hpp"

namespace softarm {

/// Least squares on smoothed derivatives: the start of the refinement.
struct LinearFit {
  Eigen::VectorXd x;               ///< in the set's scales; lag and delay as they were
  Eigen::VectorXd standard_error;  ///< of the noise alone, not of what the smoothing distorts
  double residual_rms_nm = 0.0;    ///< of a component of the generalized force
  double moment_rms_nm = 0.0;      ///< of the actuation, to compare
};

/// (16) is linear in k, beta, the gains, rest offset (times k) and the cubic stiffness. Every term
/// is taken of u smoothed by a Hann window of `window_s`, whose derivatives give u' and u''; the
/// input is smoothed alike, which leaves the linear terms exact. Frames that do not come evenly are
/// interpolated first. A combination of parameters on which the motion says nothing stays where
/// `start` has it. Standard errors count two instants a window as independent.
/// @param start in the set's scales; lag and delay are taken from it
/// @throws std::runtime_error where the record is too short or the arm does not move
LinearFit fit_linear(const ParameterSet& set, const MotionRecord& record,
                     const Eigen::VectorXd& start, double window_s);

/// The best of `fit_linear` over lags, where the set seeks one: from none to `longest_lag_s`.
LinearFit fit_linear_and_lag(const ParameterSet& set, const MotionRecord& record,
                             const Eigen::VectorXd& start, double window_s, double longest_lag_s);

}  // namespace softarm
