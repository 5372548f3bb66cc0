// Against first-order autoregressions, whose long-run variance is known.
#include "commissioning/identification/serial_correlation.hpp"

#include <gtest/gtest.h>

#include "softarm/simulation/random.hpp"

namespace softarm {
namespace {

/// Unit variance, correlation `colour` from row to row.
Eigen::MatrixXd coloured(Eigen::Index rows, Eigen::Index columns, double colour) {
  RandomNumbers random(3);
  Eigen::MatrixXd out(rows, columns);
  for (Eigen::Index j = 0; j < columns; ++j) {
    out(0, j) = random.normal();
    for (Eigen::Index k = 1; k < rows; ++k)
      out(k, j) = colour * out(k - 1, j) + std::sqrt(1.0 - colour * colour) * random.normal();
  }
  return out;
}

TEST(SerialCorrelation, InflationIsThatOfAnAutoregression) {
  EXPECT_NEAR(variance_inflation(coloured(40000, 4, 0.0)), 1.0, 0.1);
  EXPECT_NEAR(variance_inflation(coloured(40000, 4, 0.5)), 3.0, 0.3);
  EXPECT_NEAR(variance_inflation(coloured(40000, 4, 0.9)), 19.0, 2.0);
}

TEST(SerialCorrelation, SumCovarianceIsThatOfAnAutoregression) {
  for (const double colour : {0.0, 0.6, 0.9}) {
    const Eigen::Index rows = 40000;
    const Eigen::MatrixXd sum = sum_covariance(coloured(rows, 2, colour)) / rows;
    const double expected = (1.0 + colour) / (1.0 - colour);
    EXPECT_NEAR(sum(0, 0), expected, 0.12 * expected) << colour;
    EXPECT_NEAR(sum(1, 1), expected, 0.12 * expected) << colour;
    EXPECT_NEAR(sum(0, 1), 0.0, 0.12 * expected) << colour;
  }
}

TEST(SerialCorrelation, ColumnsThatMoveTogetherStayTogether) {
  Eigen::MatrixXd scores(20000, 2);
  scores.col(0) = coloured(20000, 1, 0.7);
  scores.col(1) = -2.0 * scores.col(0);
  const Eigen::MatrixXd sum = sum_covariance(scores);
  EXPECT_NEAR(sum(0, 1), -2.0 * sum(0, 0), 1e-9 * sum(0, 0));
  EXPECT_NEAR(sum(1, 1), 4.0 * sum(0, 0), 1e-9 * sum(0, 0));
}

TEST(SerialCorrelation, StudentsQuantile) {
  // Of the tables; beyond a few degrees of freedom.
  EXPECT_NEAR(student_975(3.0), 3.182, 0.03);
  EXPECT_NEAR(student_975(10.0), 2.228, 0.002);
  EXPECT_NEAR(student_975(1e9), 1.96, 1e-4);
}

}  // namespace
}  // namespace softarm
