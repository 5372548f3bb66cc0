// The parameters whose simulated response is nearest to the recorded one, with their uncertainty.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "softarm/commissioning/identification/parameter_set.hpp"

namespace softarm {

/// Settings of `refine`. What is compared is u in rad, or, where the set is of the elongation, the
/// lengths by `chord_lengths_m` in m: all below that ends in _rad is then in m.
struct RefinementOptions {
  int most_rounds = 40;
  /// Standard deviation, in the parameters' scales, of the prior at the set's `expected` values; 0:
  /// no prior.
  double prior = 0.0;
  /// false: all components have the same weight, so that the RMS is minimised (without a prior).
  bool weighted = true;
  int threads = 1;
  /// true: the start is near. Correlated frames count as few from the first weighting on, so that the
  /// prior has its weight, and the search ends when the weights do not change. From far away they
  /// would not let go of the prior: what is left there is all correlated.
  bool near = false;
  bool intervals = true;  ///< false: without covariance and singular values
  /// A round that lowers the cost by less, in squared standard errors, is the last.
  double least_gain = 1e-4;
  std::function<void(const std::string&)> progress;  ///< may be empty
};

/// The result of a fit. All quantities of x are in the scales of the set.
struct Refinement {
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;                  ///< of x, with the residuals' correlation in time
  double quantile = 1.96;                      ///< half a 95 % interval, in standard errors
  Eigen::VectorXd time_s;                      ///< of the frames compared
  Eigen::MatrixXd measured_rad, residual_rad;  ///< a row a frame; measured minus simulated
  double rms_rad = 0.0;                        ///< of a component of the residual
  double motion_rms_rad = 0.0;                 ///< of a component of the motion about its mean
  double inflation = 1.0;  ///< how many frames count as one, by the correlation of the residuals

  /// Singular values of the whitened sensitivities, largest first, and the combinations of x that
  /// they belong to, in columns: 1 over a singular value is the standard error of its combination.
  Eigen::VectorXd singular_values;
  Eigen::MatrixXd combinations;
  int held = 0;  ///< how many of the last combinations the data do not determine; they are kept

  int rounds = 0;
  bool converged = false;

  double half_width(Eigen::Index i) const;  ///< of the 95 % interval of x[i]
};

/// Minimises sum r' W r over frames, r = measured - simulated u, by Levenberg and Marquardt's
/// method; W is the inverse of the covariance of the residuals over the components of a frame,
/// which is estimated again twice. Sensitivities are finite differences of the simulation. A
/// combination of parameters whose standard error exceeds 1 (in their scales, that is 100 %) keeps
/// its value. A parameter that would leave its possible range stays at its limit. The covariance of
/// x is the sandwich (J'WJ)^-1 S (J'WJ)^-1, with S the covariance of the scores J'W r summed over
/// time (see `sum_covariance`): it is valid for filtered and for white noise.
/// @param start  in the scales of the set
/// @throws std::runtime_error if no response can be simulated at `start`
Refinement refine(const ParameterSet& set, const MotionRecord& record, const Eigen::VectorXd& start,
                  const RefinementOptions& options);

/// The same for several records of one arm with one zero, together. Times in the result are those of
/// every record, one after the other.
Refinement refine(const ParameterSet& set, std::span<const MotionRecord> records,
                  const Eigen::VectorXd& start, const RefinementOptions& options);

/// The response at `x` without a fit, compared in the same way.
Refinement predict(const ParameterSet& set, const MotionRecord& record, const Eigen::VectorXd& x);

/// d u / d x at the frames compared, by finite differences: one row per component of a frame, frame
/// by frame; one column per parameter.
Eigen::MatrixXd sensitivities(const ParameterSet& set, const MotionRecord& record,
                              const Eigen::VectorXd& x, int threads);

}  // namespace softarm
