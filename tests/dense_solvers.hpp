// Decompositions that tests compare with, compiled once: each takes the compiler seconds.
#pragma once

#include <Eigen/Core>

namespace softarm::test {

/// exp(A), n x n, to rounding: the state of x' = A x after one unit of time.
Eigen::MatrixXd exponential(const Eigen::MatrixXd& A);

/// The Moore-Penrose inverse: least norm among least squares.
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A);

/// Descending.
Eigen::VectorXd singular_values(const Eigen::MatrixXd& A);

}  // namespace softarm::test
