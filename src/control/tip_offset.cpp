#include "control/tip_offset.hpp"

#include <algorithm>
#include <numbers>

namespace softarm {
namespace {

// Lengths in units of the arm's. But for the prior only ratios matter.
constexpr double kNoise = 1e-6;               ///< density of what the fit does not explain, 1/Hz
constexpr double kPriorM = 0.1 * 0.1;         ///< variance of an element of M
constexpr double kPath = 0.15;                ///< M of a path of this size is followed at map_rate
constexpr double kLargestM = 1.0;             ///< Frobenius norm
constexpr double kLongestPrediction_s = 0.1;  ///< of the line: then it rests

}  // namespace

TipOffset::TipOffset(double bandwidth_radps, double map_rate_1ps, double reach_m) noexcept
    : bandwidth_(bandwidth_radps),
      map_drift_(kNoise * map_rate_1ps * map_rate_1ps / (kPath * kPath)),
      reach_m_(reach_m) {
  start(0.0, Eigen::Vector3d::Zero());
}

void TipOffset::start(double time_s, const Eigen::Vector3d& offset_m) noexcept {
  time_s_ = time_s;
  fit_.setZero();
  fit_.col(0) = offset_m / reach_m_;
  const double w = bandwidth_;
  Row variance;  // of the line as in the steady state
  variance << std::numbers::sqrt2 * w * kNoise, std::numbers::sqrt2 * w * w * w * kNoise,
      Eigen::Vector3d::Constant(map_drift_ > 0.0 ? kPriorM : 0.0);
  spread_ = variance.asDiagonal();
  spread_(0, 1) = spread_(1, 0) = w * w * kNoise;
}

void TipOffset::predict(double passed_s) noexcept {
  const double h = passed_s;
  fit_.col(0) += h * fit_.col(1);
  spread_.row(0) += h * spread_.row(1);
  spread_.col(0) += h * spread_.col(1);
  const double w2 = bandwidth_ * bandwidth_, q = w2 * w2 * kNoise;
  spread_(0, 0) += q * h * h * h / 3.0;
  spread_(0, 1) += q * h * h / 2.0;
  spread_(1, 0) += q * h * h / 2.0;
  spread_(1, 1) += q * h;
  for (int i = 2; i < kStates; ++i)
    spread_(i, i) = std::min(spread_(i, i) + map_drift_ * h, std::max(spread_(i, i), kPriorM));
}

void TipOffset::measure(double time_s, const Eigen::Vector3d& offset_m,
                        const Eigen::Vector3d& path_m) noexcept {
  const double passed = time_s - time_s_;
  if (!(passed > 0.0)) return;
  time_s_ = time_s;
  predict(std::min(passed, kLongestPrediction_s));
  Row regressor;
  regressor << 1.0, 0.0, path_m / reach_m_;
  const Row shared = spread_ * regressor;
  const Row gain = shared / (regressor.dot(shared) + kNoise / passed);
  fit_ += (offset_m / reach_m_ - fit_ * regressor) * gain.transpose();
  spread_ -= gain * shared.transpose();
  spread_ = (0.5 * (spread_ + spread_.transpose())).eval();
  const double size = fit_.rightCols<3>().norm();
  if (size > kLargestM) fit_.rightCols<3>() *= kLargestM / size;
}

TipReference TipOffset::at(double time_s, const TipReference& path) const noexcept {
  const double age = time_s - time_s_;
  const auto map = fit_.rightCols<3>();
  TipReference out;
  out.position_m = reach_m_ * (fit_.col(0) + std::min(age, kLongestPrediction_s) * fit_.col(1)) +
                   map * path.position_m;
  out.velocity_mps = map * path.velocity_mps;
  if (age < kLongestPrediction_s) out.velocity_mps += reach_m_ * fit_.col(1);
  out.acceleration_mps2 = map * path.acceleration_mps2;
  return out;
}

}  // namespace softarm
