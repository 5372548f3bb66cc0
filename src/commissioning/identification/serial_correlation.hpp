// The loss of information in correlated samples compared with independent ones.
#pragma once

#include <Eigen/Core>

namespace softarm {

/// The covariance of the sum over the rows of `scores`, whose rows are correlated in time:
/// heteroskedasticity- and autocorrelation-consistent, after Andrews and Monahan (1992): every
/// column is whitened by a first-order autoregression, what is left summed under Bartlett's window
/// with Andrews' bandwidth, and coloured again.
Eigen::MatrixXd sum_covariance(const Eigen::MatrixXd& scores);

/// Variance of the mean of rows over that of as many independent rows, at least 1: 1 + 2 sum rho,
/// averaged over the columns and summed until the correlation has died away.
double variance_inflation(const Eigen::MatrixXd& rows);

/// 97.5 % quantile of Student's t.
double student_975(double degrees_of_freedom);

}  // namespace softarm
