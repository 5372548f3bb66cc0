#include <algorithm>

#include "commissioning/preflight/geometry.hpp"
#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/estimation/pose_statistics.hpp"

namespace softarm {

MeanPoses mean_poses(const Observation& seen, std::int64_t from_ns, std::int64_t to_ns, int bodies,
                     std::vector<BodyPose> SeenFrame::*poses) {
  const auto count = static_cast<std::size_t>(std::max(0, bodies));
  MeanPoses out;
  out.body.assign(count, BodyPose{});
  out.seen.assign(count, 0.0);
  std::vector<MeanPose> mean(count);
  for (const SeenFrame& frame : seen.frames) {
    if (frame.arrival_ns < from_ns || frame.arrival_ns >= to_ns) continue;
    ++out.frames;
    for (std::size_t i = 0; i < std::min(count, (frame.*poses).size()); ++i) {
      const BodyPose& pose = (frame.*poses)[i];
      if (!pose.valid || !pose.position_m.allFinite() || !pose.orientation.coeffs().allFinite())
        continue;
      mean[i].add(pose.position_m, pose.orientation);
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (mean[i].count() == 0) continue;
    out.body[i] = {.position_m = mean[i].position_m(),
                   .orientation = mean[i].orientation(),
                   .valid = mean[i].quaternion_length() > 0.0};
    // With the mean length of the quaternions, which should be one.
    out.body[i].orientation.coeffs() *= mean[i].quaternion_length();
    out.seen[i] = static_cast<double>(mean[i].count()) / out.frames;
  }
  return out;
}

bool curvature_of(const Experiment& experiment, const MeanPoses& poses, Eigen::VectorXd& u_rad) {
  const int n = experiment.arm.size();
  const CurvatureEstimator estimator(experiment.estimation, experiment.arm,
                                     body_noise(experiment.estimation, n));
  u_rad.setZero(2 * n);
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (!poses.body[k].valid || !poses.body[k + 1].valid) return false;
    const SegmentCurvature one = estimator.segment(i, poses.body[k], poses.body[k + 1]);
    if (!one.valid) return false;
    u_rad.segment<2>(2 * i) = one.u_rad;
  }
  return true;
}

}  // namespace softarm
