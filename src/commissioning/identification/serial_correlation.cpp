#include "commissioning/identification/serial_correlation.hpp"

#include <algorithm>
#include <cmath>

namespace softarm {
namespace {

constexpr double kMostColour = 0.97;  ///< as Andrews and Monahan bound it

double lag_one(const Eigen::VectorXd& x) {
  const double squared = x.squaredNorm();
  const Eigen::Index n = x.size() - 1;
  return squared > 0.0 ? x.head(n).dot(x.tail(n)) / squared : 0.0;
}

}  // namespace

Eigen::MatrixXd sum_covariance(const Eigen::MatrixXd& scores) {
  const Eigen::Index rows = scores.rows(), columns = scores.cols();
  Eigen::MatrixXd white = scores.bottomRows(rows - 1);
  Eigen::VectorXd colour(columns);
  double numerator = 0.0, denominator = 0.0;
  for (Eigen::Index j = 0; j < columns; ++j) {
    const double rho = std::clamp(lag_one(scores.col(j)), -kMostColour, kMostColour);
    white.col(j) -= rho * scores.col(j).head(rows - 1);
    colour[j] = 1.0 / (1.0 - rho);
    // Each column weighs in units of its spread, as parameters do.
    const double left = std::clamp(lag_one(white.col(j)), -kMostColour, kMostColour);
    numerator += 4.0 * left * left / (std::pow(1.0 - left, 6) * std::pow(1.0 + left, 2));
    denominator += 1.0 / std::pow(1.0 - left, 4);
  }
  const auto count = static_cast<double>(rows - 1);
  const double bandwidth =
      denominator > 0.0 ? 1.1447 * std::cbrt(numerator / denominator * count) : 0.0;
  const auto reach = static_cast<Eigen::Index>(std::min(bandwidth, 0.25 * count));
  Eigen::MatrixXd sum = white.transpose() * white;
  for (Eigen::Index lag = 1; lag <= reach; ++lag) {
    const double weight = 1.0 - static_cast<double>(lag) / (bandwidth + 1.0);
    const Eigen::MatrixXd cross =
        white.bottomRows(white.rows() - lag).transpose() * white.topRows(white.rows() - lag);
    sum += weight * (cross + cross.transpose());
  }
  return colour.asDiagonal() * sum * colour.asDiagonal();
}

double variance_inflation(const Eigen::MatrixXd& rows) {
  const double squared = rows.squaredNorm();
  double inflation = 1.0;
  if (!(squared > 0.0)) return inflation;
  for (Eigen::Index lag = 1; lag < rows.rows() / 2; ++lag) {
    const double rho =
        rows.topRows(rows.rows() - lag).cwiseProduct(rows.bottomRows(rows.rows() - lag)).sum() /
        squared;
    if (rho < 2.0 / std::sqrt(static_cast<double>(rows.rows()))) break;
    inflation += 2.0 * rho;
  }
  return std::min(inflation, 0.25 * static_cast<double>(rows.rows()));
}

double student_975(double degrees_of_freedom) {
  const double v = std::max(1.0, degrees_of_freedom);
  return 1.959964 + (2.3722 + (2.8225 + (2.5558 + 2.996 / v) / v) / v) / v;
}

}  // namespace softarm
