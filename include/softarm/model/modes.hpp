// Eigenvalues and modes of symmetric matrices: how fast a linear arm swings or settles.
#pragma once

#include <Eigen/Core>

namespace softarm {

/// A V = B V diag(values), V' B V = 1.
struct Modes {
  Eigen::VectorXd values;   ///< n, ascending
  Eigen::MatrixXd vectors;  ///< n x n, a mode a column
};

/// Of the symmetric n x n matrix A, with B = 1. Not for the loop: allocates.
Modes symmetric_modes(const Eigen::MatrixXd& A);

/// Of the symmetric A with the symmetric positive definite B, n x n: with stiffness and inertia the
/// squares of natural angular frequencies (1/s^2), with damping and inertia rates of decay (1/s).
/// Not for the loop: allocates.
Modes symmetric_modes(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

}  // namespace softarm
