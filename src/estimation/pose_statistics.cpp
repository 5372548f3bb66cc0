#include "softarm/estimation/pose_statistics.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kBlock_ns = 100'000'000;
constexpr double kDeviations = 6.0;
constexpr double kLeastWander_m = 0.3e-3;
constexpr double kLeastWander_rad = 3e-3;

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& q) {
  const Eigen::AngleAxisd turn(q.w() < 0.0 ? Eigen::Quaterniond(-q.coeffs()) : q);
  return turn.angle() * turn.axis();
}

/// Of one quantity with three axes, which is zero in the mean.
struct Scatter {
  double spread = 0.0, error = 0.0, wander = 0.0, limit = 0.0;
};

Scatter scatter(const std::vector<Eigen::Vector3d>& values, std::span<const TimedPose> poses,
                double least_limit) {
  Scatter out;
  double squares = 0.0, steps = 0.0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    squares += values[k].squaredNorm() / 3.0;
    if (k > 0) steps += (values[k] - values[k - 1]).squaredNorm() / 6.0;
  }
  const auto count = static_cast<double>(values.size());
  out.spread = std::sqrt(squares / (count - 1.0));
  const double noise = std::sqrt(steps / (count - 1.0));  // slow motion is no part of it
  double of_means = 0.0, blocks = 0.0;
  for (std::size_t first = 0; first < values.size();) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::size_t next = first;
    while (next < values.size() && poses[next].time_ns - poses[first].time_ns < kBlock_ns)
      sum += values[next++];
    const auto size = static_cast<double>(next - first);
    const Eigen::Vector3d mean = sum / size;
    // The block that is farthest beyond, or nearest to, what its own number of frames allows.
    const double limit = std::max(least_limit, kDeviations * noise / std::sqrt(size));
    if (out.limit == 0.0 || mean.norm() * out.limit > out.wander * limit) {
      out.wander = mean.norm();
      out.limit = limit;
    }
    of_means += mean.squaredNorm() / 3.0;
    blocks += 1.0;
    first = next;
  }
  out.error = blocks > 1.0 ? std::sqrt(of_means / (blocks - 1.0) / blocks) : out.spread;
  return out;
}

}  // namespace

void MeanPose::add(const Eigen::Vector3d& position_m,
                   const Eigen::Quaterniond& orientation) noexcept {
  ++count_;
  position_sum_ += position_m;
  const double length = orientation.norm();
  length_sum_ += length;
  if (length == 0.0) return;
  const Eigen::Vector4d q = orientation.coeffs() / length;
  products_ += q * q.transpose();
}

Eigen::Quaterniond MeanPose::orientation() const noexcept {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(products_);
  const Eigen::Vector4d largest = solver.eigenvectors().col(3);
  return Eigen::Quaterniond(largest).normalized();
}

Eigen::Isometry3d MeanPose::pose() const noexcept {
  return Eigen::Translation3d(position_m()) * orientation();
}

std::vector<Eigen::Isometry3d> frames_on_bodies(const ArmParameters& arm, ConstVectorRef u_rad,
                                                std::span<const Eigen::Isometry3d> mean) {
  std::vector<Eigen::Isometry3d> frames(static_cast<std::size_t>(arm.size()) + 1);
  frames[0].linear() = arm.base_rotation;
  frames[0].translation() = arm.base_position_m;
  forward_kinematics(arm, u_rad, std::span(frames).subspan(1));
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i] = mean[i].inverse() * frames[i];
  return frames;
}

PoseStatistics pose_statistics(std::span<const TimedPose> poses) {
  PoseStatistics out;
  out.frames = static_cast<int>(poses.size());
  MeanPose mean;
  for (const TimedPose& pose : poses) mean.add(pose.position_m, pose.orientation);
  out.mean = mean.pose();
  const Eigen::Vector3d position = mean.position_m();
  const Eigen::Quaterniond orientation = mean.orientation();
  std::vector<Eigen::Vector3d> shifts, turns;
  for (const TimedPose& pose : poses) {
    shifts.push_back(pose.position_m - position);
    turns.push_back(rotation_vector(orientation.conjugate() * pose.orientation.normalized()));
  }
  const Scatter shift = scatter(shifts, poses, kLeastWander_m);
  const Scatter turn = scatter(turns, poses, kLeastWander_rad);
  out.position_spread_m = shift.spread;
  out.position_error_m = shift.error;
  out.wander_m = shift.wander;
  out.wander_limit_m = shift.limit;
  out.orientation_spread_rad = turn.spread;
  out.orientation_error_rad = turn.error;
  out.wander_rad = turn.wander;
  out.wander_limit_rad = turn.limit;
  return out;
}

}  // namespace softarm
