// The parameters whose simulated response is nearest to the recorded one, and how sure they are.
#pragma once

#include <functional>
#include <string>

#include "softarm/commissioning/identification/parameter_set.hpp"

namespace softarm {

/// How the nonlinear fit searches.
struct RefinementOptions {
  int most_rounds = 40;
  /// Standard deviation, in the parameters' scales, of what was configured before; 0: nothing was.
  double prior = 0.0;
  /// false: every component weighs alike, so that the RMS itself is least (without a prior).
  bool weighted = true;
  int threads = 1;
  std::function<void(const std::string&)> progress;  ///< may be empty
};

/// Everything about x is in the scales of the set.
struct Refinement {
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;                  ///< of x, with the residuals' correlation in time
  double quantile = 1.96;                      ///< half a 95 % interval, in standard errors
  Eigen::VectorXd time_s;                      ///< of the frames compared
  Eigen::MatrixXd measured_rad, residual_rad;  ///< a row a frame; measured minus simulated
  double rms_rad = 0.0;                        ///< of a component of the residual
  double motion_rms_rad = 0.0;                 ///< of a component of the motion about its mean
  double inflation = 1.0;  ///< as many frames count as one, so correlated are the residuals

  /// Of the whitened sensitivities, largest first, and the combinations of x they belong to, in
  /// columns: 1 over a singular value is the standard error of its combination.
  Eigen::VectorXd singular_values;
  Eigen::MatrixXd combinations;
  int held = 0;  ///< the last so many combinations are not told by the data and stay as they were

  int rounds = 0;
  bool converged = false;

  double half_width(Eigen::Index i) const;  ///< of the 95 % interval of x[i]
};

/// Minimises sum r' W r over frames, r = measured - simulated u, by Levenberg and Marquardt's
/// method; W is the inverse of the residuals' own covariance over the components of a frame, found
/// anew twice. Sensitivities are finite differences of the simulation. A combination of
/// parameters whose standard error exceeds 1 (in their scales, hence 100 %) stays as it was. A
/// parameter that would leave what is possible rests against its limit.
/// The covariance is the sandwich (J'WJ)^-1 S (J'WJ)^-1, S that of the scores J'W r summed over
/// time (see `sum_covariance`): it holds for noise that is filtered as for noise that is white.
/// @throws std::runtime_error where no response can be simulated at `start`
Refinement refine(const ParameterSet& set, const MotionRecord& record, const Eigen::VectorXd& start,
                  const RefinementOptions& options);

/// The response without any fit, compared alike.
Refinement predict(const ParameterSet& set, const MotionRecord& record, const Eigen::VectorXd& x);

/// d u / d x of the frames compared, components of a frame below each other, by finite differences.
Eigen::MatrixXd sensitivities(const ParameterSet& set, const MotionRecord& record,
                              const Eigen::VectorXd& x, int threads);

}  // namespace softarm
