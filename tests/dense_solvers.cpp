#include "dense_solvers.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>

namespace softarm::test {

Eigen::MatrixXd exponential(const Eigen::MatrixXd& A) {
  const int halvings = std::max(0, 2 + std::ilogb(A.cwiseAbs().rowwise().sum().maxCoeff()));
  const Eigen::MatrixXd part = std::ldexp(1.0, -halvings) * A;  // of norm 1 / 2 at most
  Eigen::MatrixXd result = Eigen::MatrixXd::Identity(A.rows(), A.cols());
  for (int k = 16; k > 0; --k)  // its series, by Horner's scheme
    result = Eigen::MatrixXd::Identity(A.rows(), A.cols()) + part * result / k;
  for (int k = 0; k < halvings; ++k) result *= result;
  return result;
}

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A) {
  return A.completeOrthogonalDecomposition().pseudoInverse();
}

Eigen::VectorXd singular_values(const Eigen::MatrixXd& A) {
  return Eigen::JacobiSVD<Eigen::MatrixXd>(A).singularValues();
}

}  // namespace softarm::test
