// Linear least squares on (16): the start of the refinement, and the only method for arms whose
// response cannot be simulated quickly.
#pragma once

#include "softarm/commissioning/identification/parameter_set.hpp"

namespace softarm {

/// The result of a linear fit.
struct LinearFit {
  Eigen::VectorXd x;               ///< in the scales of the set; lag and delay as given
  Eigen::VectorXd standard_error;  ///< from noise alone, without the error of the smoothing
  double residual_rms_nm = 0.0;    ///< of a component of the generalized force
  double moment_rms_nm = 0.0;      ///< of the actuation, for comparison
};

/// (16) is linear in k, beta, the gains, rest offset (times k) and the cubic stiffness. Every term
/// is computed from u smoothed by a Hann window of `window_s`, whose derivatives give u' and u'';
/// the input is smoothed in the same way, which leaves the linear terms exact. Unevenly spaced
/// frames are interpolated first. A combination of parameters that the motion does not determine
/// keeps its value in `start`. Standard errors count two instants per window as independent.
/// @param start  in the scales of the set; lag and delay are taken from it
/// @throws std::runtime_error if the record is too short or the arm does not move
LinearFit fit_linear(const ParameterSet& set, const MotionRecord& record,
                     const Eigen::VectorXd& start, double window_s);

/// The best `fit_linear` over lags from 0 to `longest_lag_s`, if the set contains a lag.
LinearFit fit_linear_and_lag(const ParameterSet& set, const MotionRecord& record,
                             const Eigen::VectorXd& start, double window_s, double longest_lag_s);

}  // namespace softarm
