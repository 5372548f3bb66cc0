#include "softarm/commissioning/identification/residual_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace softarm {
namespace {

constexpr Eigen::Index kInstants = 1200;  ///< of the input, over the record
constexpr Eigen::Index kPhases = 100;     ///< of a cycle
constexpr double kMoves_bar = 1e-4;       ///< less is rounding
constexpr double kRepeats = 0.6;          ///< autocorrelation of what repeats
constexpr double kAsHigh = 0.9;           ///< of the highest peak: the first of many

/// Rows on straight lines between those of `time_s`, at even instants.
Eigen::MatrixXd evenly(const Eigen::VectorXd& time_s, const Eigen::MatrixXd& rows, double from_s,
                       double step_s, Eigen::Index count) {
  Eigen::MatrixXd out(count, rows.cols());
  Eigen::Index next = 1;
  for (Eigen::Index k = 0; k < count; ++k) {
    const double t = from_s + static_cast<double>(k) * step_s;
    while (next + 1 < time_s.size() && time_s[next] < t) ++next;
    const double x =
        std::clamp((t - time_s[next - 1]) / (time_s[next] - time_s[next - 1]), 0.0, 1.0);
    out.row(k) = (1.0 - x) * rows.row(next - 1) + x * rows.row(next);
  }
  return out;
}

double mean_square(const Eigen::MatrixXd& rows) {
  return rows.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, rows.size()));
}

}  // namespace

double input_period_s(const InputTrack& input, double from_s, double to_s) {
  const double step_s = (to_s - from_s) / static_cast<double>(kInstants);
  if (input.time_s.size() < 2 || !(step_s > 0.0)) return 0.0;
  Eigen::MatrixXd x = evenly(input.time_s, input.value, from_s, step_s, kInstants);
  x.rowwise() -= x.colwise().mean().eval();
  if (!(mean_square(x) > kMoves_bar * kMoves_bar)) return 0.0;
  const Eigen::Index longest = kInstants / 3;
  Eigen::VectorXd likeness(longest + 1);
  for (Eigen::Index lag = 0; lag <= longest; ++lag) {
    const auto a = x.topRows(kInstants - lag), b = x.bottomRows(kInstants - lag);
    likeness[lag] = a.cwiseProduct(b).sum() / std::sqrt(a.squaredNorm() * b.squaredNorm());
  }
  Eigen::Index begin = 1;
  while (begin < longest && likeness[begin] > 0.0) ++begin;
  const double highest = likeness.tail(longest + 1 - begin).maxCoeff();
  if (begin >= longest || highest < kRepeats) return 0.0;
  for (Eigen::Index lag = begin; lag < longest; ++lag) {
    const bool peak = likeness[lag] >= likeness[lag - 1] && likeness[lag] >= likeness[lag + 1];
    if (!peak || likeness[lag] < kAsHigh * highest) continue;
    // The top of the parabola through three points.
    const double curved = likeness[lag - 1] - 2.0 * likeness[lag] + likeness[lag + 1];
    const double shift =
        curved < 0.0 ? 0.5 * (likeness[lag - 1] - likeness[lag + 1]) / curved : 0.0;
    return step_s * (static_cast<double>(lag) + shift);
  }
  return 0.0;
}

ResidualParts residual_parts(const MotionRecord& record, const Refinement& fit) {
  const double from_s = fit.time_s[0], to_s = fit.time_s[fit.time_s.size() - 1];
  ResidualParts out;
  out.period_s = input_period_s(record.input, from_s, to_s);
  if (!(out.period_s > 0.0)) {
    out.other_rad = fit.rms_rad;
    return out;
  }
  const double step_s = out.period_s / static_cast<double>(kPhases);
  const auto count = static_cast<Eigen::Index>(std::floor((to_s - from_s) / step_s));
  const Eigen::MatrixXd residual = evenly(fit.time_s, fit.residual_rad, from_s, step_s, count);

  // The mean over the cycle around an instant; at the ends that of the nearest whole one.
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(count + 1, residual.cols());
  for (Eigen::Index k = 0; k < count; ++k) sums.row(k + 1) = sums.row(k) + residual.row(k);
  Eigen::MatrixXd drift(count, residual.cols());
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index first = std::clamp<Eigen::Index>(k - kPhases / 2, 0, count - kPhases);
    drift.row(k) = (sums.row(first + kPhases) - sums.row(first)) / static_cast<double>(kPhases);
  }
  Eigen::MatrixXd left = residual - drift;
  Eigen::MatrixXd cycle = Eigen::MatrixXd::Zero(kPhases, residual.cols());
  Eigen::VectorXd times = Eigen::VectorXd::Zero(kPhases);
  for (Eigen::Index k = 0; k < count; ++k) {
    cycle.row(k % kPhases) += left.row(k);
    times[k % kPhases] += 1.0;
  }
  cycle.array().colwise() /= times.array();
  double squared = 0.0;
  for (Eigen::Index k = 0; k < count; ++k) {
    squared += cycle.row(k % kPhases).squaredNorm();
    left.row(k) -= cycle.row(k % kPhases);
  }
  out.drift_rad = std::sqrt(mean_square(drift));
  out.cycle_rad = std::sqrt(squared / static_cast<double>(residual.size()));
  out.other_rad = std::sqrt(mean_square(left));
  return out;
}

std::string residual_parts_text(const ResidualParts& parts) {
  if (!(parts.period_s > 0.0))
    return "the input does not repeat: the residual is not taken apart\n";
  return fmt::format(
      "of the residual, rms a component: {:.2f} mrad drift (its mean over a cycle of {:.2f} s), "
      "{:.2f} mrad the same in every cycle, {:.2f} mrad the rest\n",
      1e3 * parts.drift_rad, parts.period_s, 1e3 * parts.cycle_rad, 1e3 * parts.other_rad);
}

}  // namespace softarm
