// k, beta and the gain of the chambers from a step response, by linear least squares on (16).
#pragma once

#include <optional>
#include <vector>

#include "identification/step_response.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// A value and its standard error.
struct Estimated {
  double value = 0.0;
  double standard_error = 0.0;
};

/// One a segment, or one for all.
struct ParameterFit {
  std::vector<Estimated> stiffness_nm_per_rad;
  std::vector<Estimated> damping_nms_per_rad;
  std::vector<Estimated> gain_factor;  ///< on the configured gains; empty with actuation by torque
  double residual_rms_nm = 0.0;        ///< of a component of the generalized force
  double moment_rms_nm = 0.0;          ///< of the actuation, to compare
};

/// (16) is linear in its unknowns: k u + beta u' - f A tau_A = -(B u'' + C u' + G), with mass and
/// length as configured. Every term is taken of u smoothed by a Hann window of `window_s`, whose
/// derivatives give u' and u''; the input is smoothed alike, which leaves the linear terms exact.
/// Standard errors count two instants a window as independent.
/// @throws std::runtime_error where the response is too short or does not move the arm
ParameterFit fit_parameters(const Experiment& experiment, const StepResponse& response,
                            bool per_segment, double window_s = 0.2);

}  // namespace softarm
