// The covariance against a dense Kalman filter in long double, with the matrix exponential.
#include "estimation/error_covariance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace softarm {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Wide = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

/// The linearized arm in full-size matrices.
struct Dense {
  MatrixXd B, K, regressors;
  VectorXd damping;
};

/// A plausible arm of `dof` coordinates: B positive definite, unlike entries everywhere.
Dense dense_model(int dof) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto draw = [&](int columns) {
    MatrixXd out(dof, columns);
    for (double& each : out.reshaped()) each = normal(random);
    return out;
  };
  const MatrixXd one = MatrixXd::Identity(dof, dof), root = draw(dof), bend = draw(dof);
  return {1e-4 * (root * root.transpose() + one), 0.6 * one + 0.03 * (bend + bend.transpose()),
          0.2 * draw(5), VectorXd::Constant(dof, 0.03)};
}

template <int k>
GroupModel<2 * k> group_model(const Dense& dense) {
  GroupModel<2 * k> model;
  model.inertia = dense.B;
  model.stiffness = dense.K;
  model.damping = dense.damping;
  model.regressors = dense.regressors;
  return model;
}

/// x' = A x of the errors, in the order of ErrorCovariance.
MatrixXd system_matrix(const Dense& dense) {
  const int dof = static_cast<int>(dense.damping.size());
  MatrixXd force(dof, 11 * dof / 2);
  force.setZero();
  force.leftCols(dof) = -dense.K;
  force.middleCols(dof, dof) = -MatrixXd(dense.damping.asDiagonal());
  force.middleCols(2 * dof, dof).setIdentity();
  for (int i = 0; i < dof / 2; ++i)
    force.block(2 * i, 3 * dof + 5 * i, 2, 5) = dense.regressors.middleRows(2 * i, 2);
  MatrixXd A = MatrixXd::Zero(11 * dof / 2, 11 * dof / 2);
  A.block(0, dof, dof, dof).setIdentity();
  A.middleRows(dof, dof) = dense.B.llt().solve(force);
  return A;
}

Wide product(const Wide& a, const Wide& b) {
  Wide out(a.rows(), b.cols());
  for (Eigen::Index i = 0; i < a.rows(); ++i)
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
      long double sum = 0.0L;
      for (Eigen::Index l = 0; l < a.cols(); ++l) sum += a(i, l) * b(l, j);
      out(i, j) = sum;
    }
  return out;
}

Wide wide(const MatrixXd& from) { return from.cast<long double>(); }

/// exp(A) by its series on A / 2^16.
Wide exponential(const MatrixXd& A) {
  const Wide small = wide(std::ldexp(1.0, -16) * A);
  Wide term = wide(MatrixXd::Identity(A.rows(), A.cols())), sum = term;
  for (int k = 1; k < 12; ++k) {
    term = product(term, small);
    for (long double& each : term.reshaped()) each /= k;
    sum += term;
  }
  for (int k = 0; k < 16; ++k) sum = product(sum, sum);
  return sum;
}

/// Largest difference of two covariances in units of the deviations in `by`.
double difference(const Wide& a, const Wide& b, const MatrixXd& by) {
  double largest = 0.0;
  for (Eigen::Index i = 0; i < a.rows(); ++i)
    for (Eigen::Index j = 0; j < a.cols(); ++j)
      largest = std::max(largest, std::abs(static_cast<double>(a(i, j) - b(i, j))) /
                                      std::sqrt(by(i, i) * by(j, j)));
  return largest;
}

template <int k>
MatrixXd propagated(const Dense& dense, double step_s, int steps, MatrixXd* before = nullptr) {
  const int dof = static_cast<int>(dense.damping.size());
  ErrorCovariance<k> errors(dof / 2);
  errors.reset(1e-4, 0.1, VectorXd::Constant(dof, 0.01), 0.04);
  if (before != nullptr) *before = errors.matrix();
  for (int i = 0; i < steps; ++i) EXPECT_TRUE(errors.propagate(step_s, group_model<k>(dense)));
  return errors.matrix();
}

TEST(ErrorCovariance, PropagatesAsTheMatrixExponentialDoes) {
  for (const int segments : {1, 2, 3, 6}) {
    const Dense dense = dense_model(2 * segments);
    MatrixXd before;
    // Of second order: half the step leaves at most a quarter of the error.
    double last = 0.0;
    for (const double step_s : {1e-4, 5e-5, 2.5e-5}) {
      const MatrixXd found = propagated<6>(dense, step_s, 1, &before);
      const Wide Phi = exponential(step_s * system_matrix(dense));
      const Wide expected = product(product(Phi, wide(before)), Phi.transpose());
      const double error = difference(wide(found), expected, found);
      EXPECT_LT(error, 2e-3) << segments << " " << step_s;
      if (last > 0.0) {
        EXPECT_LT(error, last / 4.0) << segments << " " << step_s;
      }
      last = error;
    }
  }
}

TEST(ErrorCovariance, OneSegmentOfFixedSizeIsTheSame) {
  const Dense dense = dense_model(2);
  const MatrixXd joint = propagated<6>(dense, 2e-3, 20), single = propagated<1>(dense, 2e-3, 20);
  EXPECT_LT((joint - single).norm(), 1e-12 * joint.norm());
}

TEST(ErrorCovariance, MeasuresAsADenseKalmanFilterDoes) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (const bool hold : {false, true}) {
    for (const int segments : {1, 3, 6}) {
      const int dof = 2 * segments;
      ErrorCovariance<6> errors(segments);
      errors.reset(1e-4, 0.1, VectorXd::Constant(dof, 0.01), 0.04);
      for (int step = 0; step < 5; ++step)
        ASSERT_TRUE(errors.propagate(2e-3, group_model<6>(dense_model(dof))));
      const MatrixXd P = errors.matrix();
      const MatrixXd R =
          1e-5 * (2.0 * MatrixXd::Identity(dof, dof) - (1.0 / dof) * MatrixXd::Ones(dof, dof));
      VectorXd innovation(dof);
      for (double& each : innovation) each = 0.01 * normal(random);
      ErrorCovariance<6>::Correction correction;
      double nis = 0.0;
      ASSERT_TRUE(errors.measure(innovation, R, hold, correction, nis));

      // K = P H' S^-1, without the parameters' rows where they are held; then Joseph's form, right
      // for any K, in long double.
      const MatrixXd S = P.topLeftCorner(dof, dof) + R;
      MatrixXd K = S.llt().solve(P.topRows(dof)).transpose();
      if (hold) K.bottomRows(5 * segments).setZero();
      MatrixXd rest = MatrixXd::Identity(P.rows(), P.cols());
      rest.leftCols(dof) -= K;
      const Wide expected = product(product(wide(rest), wide(P)), wide(rest).transpose()) +
                            product(product(wide(K), wide(R)), wide(K).transpose());
      EXPECT_LT(difference(wide(errors.matrix()), expected, P), 1e-11) << segments << hold;
      EXPECT_LT((correction - K * innovation).norm(), 1e-10 * (K * innovation).norm());
      EXPECT_NEAR(nis, innovation.dot(S.llt().solve(innovation)), 1e-9 * nis);
    }
  }
}

TEST(ErrorCovariance, RefusesWhatCannotBeFactored) {
  auto model = group_model<1>(dense_model(2));
  ErrorCovariance<1> errors(1);
  errors.reset(1e-4, 0.1, ErrorCovariance<1>::Vector::Constant(0.01), 0.04);
  const auto before = errors.matrix();
  model.inertia(1, 1) = -1.0;
  EXPECT_FALSE(errors.propagate(1e-3, model));
  ErrorCovariance<1>::Correction correction;
  double nis = 0.0;
  EXPECT_FALSE(errors.measure(Eigen::Vector2d::Zero(), -Eigen::Matrix2d::Identity(), false,
                              correction, nis));
  EXPECT_FALSE(errors.measure(Eigen::Vector2d::Constant(std::nan("")), Eigen::Matrix2d::Identity(),
                              false, correction, nis));
  EXPECT_EQ(errors.matrix(), before);
}

}  // namespace
}  // namespace softarm
