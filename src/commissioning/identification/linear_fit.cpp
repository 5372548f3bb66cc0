#include "softarm/commissioning/identification/linear_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "commissioning/median.hpp"

namespace softarm {
namespace {

constexpr double kMostInstants = 1e7;  ///< of a record on its even grid
constexpr double kMostPeriods =
    10.0;  ///< frames further apart, and than a window, do not show the motion
constexpr double kRidge =
    1e-6;  ///< of the mean information: keeps what the motion does not determine

/// A Hann window and its first two derivatives, sampled; each sums to what it does to 1, t, t^2
/// / 2.
struct SmoothingKernel {
  Eigen::VectorXd value, first, second;

  SmoothingKernel(double window_s, double period_s) {
    const auto half =
        std::max<Eigen::Index>(1, static_cast<Eigen::Index>(std::ceil(0.5 * window_s / period_s)));
    const double width = 2.0 * static_cast<double>(half) * period_s;
    const double rate = 2.0 * std::numbers::pi / width;
    value.resize(2 * half + 1);
    first.resize(value.size());
    second.resize(value.size());
    for (Eigen::Index k = -half; k <= half; ++k) {
      const double angle = rate * static_cast<double>(k) * period_s;
      const double weight = period_s / width;
      value[k + half] = weight * (1.0 + std::cos(angle));
      first[k + half] = weight * rate * std::sin(angle);
      second[k + half] = -weight * rate * rate * std::cos(angle);
    }
    // Its derivatives do not vanish at the ends: half of the end points belongs to the neighbours.
    second[0] *= 0.5;
    second[2 * half] *= 0.5;
  }
  Eigen::Index half() const { return value.size() / 2; }
};

/// The record on an even grid: the motion and its derivatives at every half window.
struct SmoothMotion {
  std::vector<Eigen::VectorXd> u, velocity, acceleration, input;
};

/// u on an even grid. @param apart_s  gets how far apart the frames around every instant are
Eigen::MatrixXd evenly(const MotionRecord& record, double period_s, Eigen::Index count,
                       Eigen::VectorXd& apart_s) {
  Eigen::MatrixXd u(count, record.u_rad.cols());
  apart_s.resize(count);
  Eigen::Index next = 1;
  for (Eigen::Index k = 0; k < count; ++k) {
    const double t = record.time_s[0] + static_cast<double>(k) * period_s;
    while (next + 1 < record.time_s.size() && record.time_s[next] < t) ++next;
    const double x = std::clamp(
        (t - record.time_s[next - 1]) / (record.time_s[next] - record.time_s[next - 1]), 0.0, 1.0);
    u.row(k) = (1.0 - x) * record.u_rad.row(next - 1) + x * record.u_rad.row(next);
    apart_s[k] = record.time_s[next] - record.time_s[next - 1];
  }
  return u;
}

double typical_period_s(const MotionRecord& record) {
  std::vector<double> gaps;
  for (Eigen::Index k = 1; k < record.time_s.size(); ++k)
    gaps.push_back(record.time_s[k] - record.time_s[k - 1]);
  return median(std::move(gaps));
}

SmoothMotion smooth(const MotionRecord& record, double window_s, const ArmHypothesis& arm) {
  if (record.time_s.size() < 8)
    throw std::runtime_error(fmt::format("a record of {} frames is too short: expected at least 8",
                                         record.time_s.size()));
  const double period_s = typical_period_s(record);
  const double span_s = record.time_s[record.time_s.size() - 1] - record.time_s[0];
  if (!(span_s <= kMostInstants * period_s))
    throw std::runtime_error(
        fmt::format("a record of {} frames over {:.4g} s has too few frames for its length",
                    record.time_s.size(), span_s));
  const auto count = static_cast<Eigen::Index>(std::floor(span_s / period_s + 0.5)) + 1;
  Eigen::VectorXd apart_s;
  const Eigen::MatrixXd u = evenly(record, period_s, count, apart_s);
  const double longest_s = std::max(window_s, kMostPeriods * period_s);
  Eigen::MatrixXd input(count, record.input.value.cols());
  LaggedInput lagged(record.input, arm.input_lags(), arm.dead_time_s);
  Eigen::VectorXd p(input.cols());
  for (Eigen::Index k = 0; k < count; ++k) {
    lagged.at(record.time_s[0] + static_cast<double>(k) * period_s, p);
    input.row(k) = p;
  }
  const SmoothingKernel kernel(window_s, period_s);
  SmoothMotion out;
  for (Eigen::Index k = 0; k + kernel.value.size() <= count; k += kernel.half()) {
    const double t = record.time_s[0] + static_cast<double>(k) * period_s;
    if (t < record.scored_from_s) continue;
    if (apart_s.segment(k, kernel.value.size()).maxCoeff() > longest_s) continue;  // not seen
    const auto part = u.middleRows(k, kernel.value.size()).transpose();
    out.u.emplace_back(part * kernel.value);
    out.velocity.emplace_back(part * kernel.first);
    out.acceleration.emplace_back(part * kernel.second);
    out.input.emplace_back(input.middleRows(k, kernel.value.size()).transpose() * kernel.value);
  }
  return out;
}

/// The residual of (16), instants stacked: B u'' + C u' + G + D u' + springs - input.
Eigen::VectorXd leftover(const ArmHypothesis& arm, const SmoothMotion& motion) {
  const Eigen::Index dof = arm.arm.dof();
  DynamicsWorkspace workspace(arm.arm);
  Eigen::VectorXd out(dof * static_cast<Eigen::Index>(motion.u.size())), part(dof), force(dof);
  for (std::size_t k = 0; k < motion.u.size(); ++k) {
    const Eigen::VectorXd& v = motion.velocity[k];
    inverse_dynamics(arm.arm, workspace, motion.u[k], v, v, motion.acceleration[k], {}, part);
    actuation_force(arm, motion.u[k], motion.input[k], force);
    part -= force;
    spring_force(arm, motion.u[k], force);
    part += force;
    for (Eigen::Index c = 0; c < dof; ++c)
      part[c] += arm.arm.segments[static_cast<std::size_t>(c / 2)].damping_nms_per_rad * v[c];
    out.segment(static_cast<Eigen::Index>(k) * dof, dof) = part;
  }
  return out;
}

}  // namespace

LinearFit fit_linear(const ParameterSet& set, const MotionRecord& record,
                     const Eigen::VectorXd& start, double window_s) {
  ArmHypothesis arm = set.arm(start);
  const SmoothMotion motion = smooth(record, window_s, arm);
  const Eigen::VectorXd before = leftover(arm, motion);
  if (before.size() < 4 * set.size())
    throw std::runtime_error(
        fmt::format("{} frames are too few for windows of {} s: expected a longer record",
                    record.time_s.size(), window_s));
  std::vector<Eigen::Index> sought;
  for (Eigen::Index i = 0; i < set.size(); ++i)
    if (set.linear(i)) sought.push_back(i);
  Eigen::MatrixXd X(before.size(), static_cast<Eigen::Index>(sought.size()));
  for (std::size_t j = 0; j < sought.size(); ++j) {
    Eigen::VectorXd moved = start;
    moved[sought[j]] += 1.0;
    X.col(static_cast<Eigen::Index>(j)) = leftover(set.arm(moved), motion) - before;
  }
  Eigen::MatrixXd information = X.transpose() * X;
  const double typical = information.trace() / static_cast<double>(X.cols());
  if (!(typical > 1e-12))
    throw std::runtime_error("the arm does not move: nothing can be identified");
  information.diagonal().array() += kRidge * typical;
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(information);
  const Eigen::VectorXd change = ldlt.solve(-X.transpose() * before);
  const double squared = (before + X * change).squaredNorm();
  const double variance = squared / static_cast<double>(before.size() - X.cols());
  const Eigen::MatrixXd covariance =
      variance * ldlt.solve(Eigen::MatrixXd::Identity(X.cols(), X.cols()));

  LinearFit fit;
  fit.x = start;
  fit.standard_error.setZero(set.size());
  for (std::size_t j = 0; j < sought.size(); ++j) {
    const auto column = static_cast<Eigen::Index>(j);
    fit.x[sought[j]] += change[column];
    fit.standard_error[sought[j]] = std::sqrt(covariance(column, column));
  }
  fit.residual_rms_nm = std::sqrt(squared / static_cast<double>(before.size()));
  arm = set.arm(fit.x);
  Eigen::VectorXd force(arm.arm.dof());
  for (std::size_t k = 0; k < motion.u.size(); ++k) {
    actuation_force(arm, motion.u[k], motion.input[k], force);
    fit.moment_rms_nm += force.squaredNorm();
  }
  fit.moment_rms_nm = std::sqrt(fit.moment_rms_nm / static_cast<double>(before.size()));
  return fit;
}

LinearFit fit_linear_and_lag(const ParameterSet& set, const MotionRecord& record,
                             const Eigen::VectorXd& start, double window_s, double longest_lag_s) {
  LinearFit best = fit_linear(set, record, start, window_s);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    if (set[i].name != "lag") continue;
    for (double lag_s = 0.0; lag_s <= longest_lag_s; lag_s = std::max(0.005, 1.4 * lag_s)) {
      Eigen::VectorXd tried = start;
      tried[i] = lag_s / set[i].scale;
      const LinearFit fit = fit_linear(set, record, tried, window_s);
      // Other gains give the same moments: the residual is relative to them.
      if (fit.residual_rms_nm / fit.moment_rms_nm < best.residual_rms_nm / best.moment_rms_nm)
        best = fit;
    }
  }
  return best;
}

}  // namespace softarm
