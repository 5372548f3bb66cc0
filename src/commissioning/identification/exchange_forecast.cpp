#include "commissioning/identification/exchange_forecast.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "commissioning/identification/serial_correlation.hpp"

namespace softarm {
namespace {

constexpr double kDifference = 1e-3;  ///< of the unknowns of one model in those of the other
constexpr int kLimitRounds = 4;       ///< in which unknowns beyond their limits are put there

}  // namespace

ExchangeForecast::ExchangeForecast(const ParameterSet& all, const std::vector<Fold>& folds,
                                   const std::vector<ArmHypothesis>& arms, double prior,
                                   int threads)
    : all_(all), prior_(prior) {
  for (std::size_t i = 0; i < folds.size(); ++i)
    parts_.push_back({arms[i], normal(arms[i], folds[i].seen, threads),
                      normal(arms[i], std::span(&folds[i].unseen, 1), threads)});
}

ExchangeForecast::Normal ExchangeForecast::normal(const ArmHypothesis& arm,
                                                  std::span<const MotionRecord> records,
                                                  int threads) const {
  const Eigen::VectorXd x = all_.of(arm);
  Normal out{Eigen::MatrixXd::Zero(x.size(), x.size()), Eigen::VectorXd::Zero(x.size())};
  double inflated = 0.0;
  for (const MotionRecord& record : records) {
    const Eigen::MatrixXd left = predict(all_, record, x).residual_rad;
    const Eigen::MatrixXd J = sensitivities(all_, record, x, threads);
    const Eigen::VectorXd r = left.transpose().reshaped();
    out.information += J.transpose() * J;
    out.gradient += J.transpose() * r;
    out.squares += r.squaredNorm();
    out.count += static_cast<double>(r.size());
    inflated += static_cast<double>(r.size()) * variance_inflation(left);
  }
  out.inflation = inflated / out.count;
  return out;
}

double ExchangeForecast::unseen_rad(const ParameterSet& of) const {
  double squares = 0.0, count = 0.0;
  for (const Part& part : parts_) {
    const Eigen::VectorXd x = all_.of(part.arm), expected = of.expected();
    const Eigen::VectorXd lowest = of.lowest(), highest = of.highest();
    Eigen::VectorXd y = of.of(part.arm).cwiseMax(lowest).cwiseMin(highest);
    const Eigen::VectorXd start = all_.of(of.arm(y));
    Eigen::MatrixXd map(x.size(), y.size());
    for (Eigen::Index k = 0; k < y.size(); ++k) {
      Eigen::VectorXd moved = y;
      moved[k] += kDifference;
      map.col(k) = (all_.of(of.arm(moved)) - start) / kDifference;
    }
    const Eigen::VectorXd away = start - x;
    const double weight = part.seen.count / (part.seen.squares * part.seen.inflation);
    const double pull = prior_ > 0.0 ? 1.0 / (prior_ * prior_) : 1e-9;
    Eigen::MatrixXd information = weight * map.transpose() * part.seen.information * map;
    information.diagonal().array() += pull;
    const Eigen::VectorXd gradient =
        weight * map.transpose() * (part.seen.gradient - part.seen.information * away) +
        pull * (expected - y);
    // Where an unknown would leave its limits, it is held there and the others are found again.
    Eigen::VectorXd step = Eigen::VectorXd::Zero(y.size());
    Eigen::Array<bool, Eigen::Dynamic, 1> held =
        Eigen::Array<bool, Eigen::Dynamic, 1>::Constant(y.size(), false);
    for (int round = 0; round < kLimitRounds; ++round) {
      Eigen::MatrixXd free = information;
      Eigen::VectorXd right = gradient;
      for (Eigen::Index k = 0; k < y.size(); ++k)
        if (held[k]) right -= information.col(k) * step[k];
      for (Eigen::Index k = 0; k < y.size(); ++k) {
        if (!held[k]) continue;
        free.row(k).setZero();
        free.col(k).setZero();
        free(k, k) = 1.0;
        right[k] = step[k];
      }
      step = free.ldlt().solve(right);
      bool within = true;
      for (Eigen::Index k = 0; k < y.size(); ++k) {
        const double limited = std::clamp(y[k] + step[k], lowest[k], highest[k]) - y[k];
        if (limited == step[k]) continue;
        step[k] = limited;
        held[k] = true;
        within = false;
      }
      if (within) break;
    }
    const Eigen::VectorXd moved = away + map * step;
    squares += part.unseen.squares - 2.0 * moved.dot(part.unseen.gradient) +
               moved.dot(part.unseen.information * moved);
    count += part.unseen.count;
  }
  return std::sqrt(std::max(0.0, squares) / count);
}

}  // namespace softarm
