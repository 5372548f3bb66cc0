#include "dev/bench/recordings_score.hpp"

#include <algorithm>
#include <cmath>

namespace softarm {
namespace {

constexpr double kTrialCycle_s = 10.0;  ///< of the published twin's trials
constexpr Eigen::Index kPhases = 200;

double rms(double squares, Eigen::Index count) {
  return std::sqrt(squares / static_cast<double>(std::max<Eigen::Index>(1, count)));
}

/// The mean over whole cycles, at even phases, without its mean; phases that no frame has keep the
/// value of the phase before.
Eigen::MatrixX3d mean_cycle(const Eigen::VectorXd& time_s, const Eigen::MatrixX3d& tip_m) {
  Eigen::MatrixX3d sum = Eigen::MatrixX3d::Zero(kPhases, 3);
  Eigen::VectorXd count = Eigen::VectorXd::Zero(kPhases);
  for (Eigen::Index k = 0; k < time_s.size(); ++k) {
    const double phase = std::fmod(time_s[k], kTrialCycle_s) / kTrialCycle_s;
    const auto bin = std::clamp<Eigen::Index>(
        static_cast<Eigen::Index>(phase * static_cast<double>(kPhases)), 0, kPhases - 1);
    sum.row(bin) += tip_m.row(k);
    count[bin] += 1.0;
  }
  for (Eigen::Index p = 0; p < kPhases; ++p) {
    if (count[p] > 0.0) {
      sum.row(p) /= count[p];
    } else if (p > 0) {
      sum.row(p) = sum.row(p - 1);
    }
  }
  sum.rowwise() -= sum.colwise().mean().eval();
  return sum;
}

void score_cycles(const Eigen::VectorXd& time_s, const Eigen::MatrixX3d& measured_m,
                  const Eigen::MatrixX3d& predicted_m, ArenaScore& out) {
  if (time_s[time_s.size() - 1] - time_s[0] < 2.0 * kTrialCycle_s) return;
  const Eigen::MatrixX3d measured = mean_cycle(time_s, measured_m);
  const Eigen::MatrixX3d predicted = mean_cycle(time_s, predicted_m);
  const double along = predicted.leftCols<2>().cwiseProduct(measured.leftCols<2>()).sum();
  const double across =
      predicted.col(0).dot(measured.col(1)) - predicted.col(1).dot(measured.col(0));
  const double norm = std::hypot(along, across);
  Eigen::Matrix2d turn = Eigen::Matrix2d::Identity();
  if (norm > 0.0) turn << along / norm, -across / norm, across / norm, along / norm;
  out.cycle_lateral_m = rms(
      (measured.leftCols<2>() - predicted.leftCols<2>() * turn.transpose()).squaredNorm(), kPhases);
  out.cycle_axial_m = rms((measured.col(2) - predicted.col(2)).squaredNorm(), kPhases);
}

}  // namespace

ArenaScore score(const Eigen::VectorXd& time_s, const Eigen::MatrixXd& measured_rad,
                 const Eigen::MatrixXd& predicted_rad, const Eigen::MatrixX3d& measured_tip_m,
                 const Eigen::MatrixX3d& predicted_tip_m, bool cycles) {
  ArenaScore out;
  const Eigen::Index count = measured_rad.rows();
  out.u_rad = rms((measured_rad - predicted_rad).squaredNorm(), measured_rad.size());
  const Eigen::RowVectorXd mean = measured_rad.colwise().mean();
  out.motion_rad = rms((measured_rad.rowwise() - mean).squaredNorm(), measured_rad.size());
  const Eigen::MatrixX3d error = measured_tip_m - predicted_tip_m;
  out.lateral_m = rms(error.leftCols<2>().squaredNorm(), count);
  out.axial_m = rms(error.col(2).squaredNorm(), count);
  const Eigen::RowVector3d middle = measured_tip_m.colwise().mean();
  const Eigen::MatrixX3d motion = measured_tip_m.rowwise() - middle;
  out.motion_lateral_m = rms(motion.leftCols<2>().squaredNorm(), count);
  out.motion_axial_m = rms(motion.col(2).squaredNorm(), count);
  if (cycles) score_cycles(time_s, measured_tip_m, predicted_tip_m, out);
  return out;
}

}  // namespace softarm
